// The page of a run: its curves, vehicles and pictures at one time, and the search in its parameters.
"use strict";

(() => {
  const data = JSON.parse(document.getElementById("run-data").textContent);
  const find = (id) => document.getElementById(id);
  const ends = data.runs.flatMap((run) => [run.time[0], run.time.at(-1)]).filter((time) => time !== undefined);
  const [start, stop] = ends.length ? [Math.min(...ends), Math.max(...ends)] : [0, 1];

  // Time and window stand in the address, so that it shows others the same place.
  const asked = new URLSearchParams(location.hash.slice(1));
  const keep = (key, value) => {
    if (value === null) asked.delete(key); else asked.set(key, value);
    clearTimeout(keep.waiting);
    keep.waiting = setTimeout(() => history.replaceState(null, "", `#${asked}`), 300);
  };
  const short = (time) => Number(time.toPrecision(7));
  const player = new Player((time) => { keep("t", short(time)); for (const part of parts) part.point(time); });
  const pointed = (time) => { if (!player.isPlaying) player.seek(time); };
  const zoomed = (window) => { keep("window", window?.map(short) ?? null); for (const chart of charts) chart.zoom(window); };
  const charts = data.panels.map(() => new Chart(find("curves"), { onPoint: pointed, onZoom: zoomed }));
  charts.forEach((chart, place) => chart.show(data.panels[place], data.runs, [start, stop]));
  const parts = [...charts];
  for (const element of document.querySelectorAll(".vehicle")) {
    parts.push(new Instruments(element, data.runs[element.dataset.run]));
  }
  data.runs.forEach((run, place) => {
    const isNamed = data.runs.length > 1;
    if (run.flight) parts.push(new Places(document.querySelectorAll("#flight .panel"), run.flight, `var(--c${place % 6})`));
    if (run.guarantee) find("guarantees").append(...guaranteeStrip(run, isNamed, [start, stop]));
  });

  const planned = data.runs.find((run) => run.plans);
  if (planned) parts.push(guaranteePicture(planned, data.runs.find((run) => run !== planned && run.vehicle?.rates), [stop, pointed]));

  const rows = [...document.querySelectorAll("#parameter-table tbody tr")];
  const filter = () => {
    const asked = find("search").value.trim().toLowerCase();
    const only = (id) => Boolean(find(id) && find(id).checked);
    let count = 0;
    for (const row of rows) {
      // A search goes through all parameters.
      const isThere = asked ? row.textContent.toLowerCase().includes(asked) : !only("set-only") || "set" in row.dataset;
      row.hidden = !isThere || (only("different-only") && !("differs" in row.dataset));
      if (!row.hidden) count += 1;
    }
    find("found").textContent = `${count} of ${rows.length}`;
  };
  for (const id of ["search", "set-only", "different-only"]) if (find(id)) find(id).addEventListener("input", filter);
  filter();
  player.range(start, stop);
  player.pace(stop - start);
  const at = (key) => (asked.get(key) ?? "").split(",").filter(Boolean).map(Number);
  const [[from, to], [time = start]] = [at("window"), at("t")];
  if (from < to) zoomed([from, to]);
  player.seek(Number.isFinite(time) ? time : start);
})();
