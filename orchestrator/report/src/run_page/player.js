// Plays a run: one time that the slider, the curves and the vehicles share. Space plays and pauses,
// arrows seek (with Shift ten times as far), Home and End go to the ends.
"use strict";

(() => {
  const data = JSON.parse(document.getElementById("run-data").textContent);
  const find = (id) => document.getElementById(id);
  const ends = data.runs.flatMap((run) => [run.time[0], run.time.at(-1)]).filter((time) => time !== undefined);
  const [start, stop] = ends.length ? [Math.min(...ends), Math.max(...ends)] : [0, 1];
  const span = stop - start || 1;
  const [play, slider, shown, speed] = ["play", "seek", "time", "speed"].map(find);
  let [time, last, isPlaying] = [start, null, false];

  const speeds = [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200];
  for (const factor of speeds) speed.append(new Option(`×${factor}`, factor));
  // A run plays in half a minute or less at first.
  speed.value = speeds.find((factor) => factor >= 1 && span / factor <= 30) ?? speeds.at(-1);

  const digits = Math.max(1, Math.min(4, 3 - Math.floor(Math.log10(span))));
  const seek = (asked, isFromSlider = false) => {
    time = Math.max(start, Math.min(stop, asked));
    if (!isFromSlider) slider.value = (1000 * (time - start)) / span;
    shown.textContent = `${minus(time.toFixed(digits))} s`;
    slider.setAttribute("aria-valuetext", shown.textContent);
    for (const part of parts) part.point(time);
  };
  const pause = () => { isPlaying = false; last = null; show(); };
  const show = () => {
    play.textContent = isPlaying ? "❚❚" : "▶";
    play.setAttribute("aria-label", isPlaying ? "Pause" : "Play");
  };
  const tick = (now) => {
    if (!isPlaying) return;
    if (last !== null) seek(time + ((now - last) / 1000) * Number(speed.value));
    last = now;
    if (time >= stop) pause();
    else requestAnimationFrame(tick);
  };
  const toggle = () => {
    if (isPlaying) return pause();
    isPlaying = true;
    show();
    if (time >= stop) seek(start);
    requestAnimationFrame(tick);
  };

  const pointed = (asked) => { if (!isPlaying) seek(asked); };
  const zoomed = (window) => { for (const chart of charts) chart.zoom(window); };
  const charts = data.panels.map(() => new Chart(find("curves"), { onPoint: pointed, onZoom: zoomed }));
  charts.forEach((chart, place) => chart.show(data.panels[place], data.runs, [start, stop]));
  const parts = [...charts];
  for (const element of document.querySelectorAll(".vehicle")) {
    parts.push(new Instruments(element, data.runs[element.dataset.run]));
  }
  data.runs.forEach((run, place) => {
    const isNamed = data.runs.length > 1;
    if (run.flight) parts.push(new Places(document.querySelectorAll("#flight .panel"), run.flight, `var(--c${place % 6})`));
    if (run.guarantee) find("guarantees").append(...guaranteeStrip(run, isNamed));
  });

  const planned = data.runs.find((run) => run.plans);
  if (planned) parts.push(...guaranteePictures(planned, data.runs.find((run) => run !== planned && run.vehicle?.rates), [stop, pointed]));

  play.addEventListener("click", toggle);
  slider.addEventListener("input", () => seek(start + (span * slider.value) / 1000, true));
  document.addEventListener("keydown", (event) => {
    const { key, target } = event;
    // Elements with keys of their own keep them: the search, the choices, and a view that is turned.
    const own = target.closest("input:not(#seek), select, summary, button:not(#play)");
    if (event.defaultPrevented || own || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = (span / 100) * (event.shiftKey ? 10 : 1);
    const actions = {
      " ": toggle, ArrowLeft: () => seek(time - step), ArrowRight: () => seek(time + step),
      Home: () => seek(start), End: () => seek(stop),
    };
    if (!actions[key]) return;
    event.preventDefault();
    actions[key]();
  });

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
  show();
  seek(start);
})();
