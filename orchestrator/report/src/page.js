// Figures of a page: names in a legend hide their curves, and a pointer shows values.
"use strict";
const SVG = "http://www.w3.org/2000/svg";
const numbers = (text) => text.split(" ").map(Number);

// A panel's axes. Coordinates are those of the figure, px.
class Panel {
  constructor(group) {
    this.group = group;
    this.curves = group.querySelector("svg.curves");
    [this.x, this.y, this.width, this.height] = numbers(group.dataset.frame);
    this.log = "log" in group.dataset;
    const ends = numbers(group.dataset.x);
    [this.across, this.up] = [this.log ? ends.map(Math.log10) : ends, numbers(group.dataset.y)];
  }

  // Value at a coordinate, along x.
  at(x) {
    const value = this.across[0] + ((x - this.x) / this.width) * (this.across[1] - this.across[0]);
    return this.log ? 10 ** value : value;
  }

  // Lines with their points in coordinates, read once.
  lines() {
    this.read ??= [...this.curves.querySelectorAll("path[data-name][fill=none]:not(.limit)")].map((path) => {
      const values = path.getAttribute("d").match(/-?[\d.]+/g).map(Number), points = [];
      for (let k = 0, x = 0, y = 0; k + 1 < values.length; k += 2) points.push([(x += values[k]), (y += values[k + 1])]);
      return { path, points };
    });
    return this.read;
  }

  // Names and values of the lines at a coordinate along x.
  values(at) {
    const found = [];
    for (const { path, points } of this.lines()) {
      if (path.style.display === "none" || at < points[0][0] || at > points[points.length - 1][0]) continue;
      let low = 0, high = points.length - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (points[middle][0] <= at) low = middle; else high = middle; }
      const [[x, y], [next, other]] = [points[low], points[high]];
      const here = next > x ? y + ((other - y) * (at - x)) / (next - x) : y;
      found.push([path.dataset.name, this.up[0] + (1 - (here - this.y) / this.height) * (this.up[1] - this.up[0])]);
    }
    return found;
  }
}

function wire(figure) {
  const panels = [...figure.querySelectorAll(".panel")].map((group) => new Panel(group));
  const note = document.createElement("div");
  note.className = "values";
  note.hidden = true;
  figure.parentElement.append(note);
  const where = (event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(figure.getScreenCTM().inverse());
  const under = (at) => panels.find((p) => at.x >= p.x && at.x <= p.x + p.width && at.y >= p.y && at.y <= p.y + p.height);
  const line = document.createElementNS(SVG, "path");
  line.setAttribute("class", "cursor");
  figure.addEventListener("pointermove", (event) => {
    const at = where(event), panel = under(at);
    line.remove();
    note.hidden = true;
    if (!panel) return;
    const found = panel.values(at.x);
    if (!found.length) return;
    line.setAttribute("d", `M${at.x} ${panel.y}v${panel.height}`);
    figure.append(line);
    const shown = (value) => Number(value.toPrecision(4)).toString().replace("-", "−");
    note.textContent = [`at ${shown(panel.at(at.x))}`, ...found.slice(0, 12).map(([name, value]) => `${name}: ${shown(value)}`)].join("\n");
    note.hidden = false;
    const frame = figure.parentElement.getBoundingClientRect();
    const left = event.clientX - frame.left + figure.parentElement.scrollLeft;
    note.style.left = `${left > frame.width * 0.6 ? left - note.offsetWidth - 14 : left + 14}px`;
    note.style.top = `${event.clientY - frame.top + 12}px`;
  });
  figure.addEventListener("pointerleave", () => { line.remove(); note.hidden = true; });
  // A picture has no parts that can be pressed, but a group has.
  if (figure.querySelector(".entry")) figure.setAttribute("role", "group");
  for (const entry of figure.querySelectorAll(".entry")) {
    entry.setAttribute("tabindex", 0);
    entry.setAttribute("role", "switch");
    entry.setAttribute("aria-checked", true);
    const turn = () => {
      const isOff = entry.classList.toggle("off");
      entry.setAttribute("aria-checked", !isOff);
      for (const curve of figure.querySelectorAll(".curves [data-name]"))
        if (curve.dataset.name === entry.dataset.name) curve.style.display = isOff ? "none" : "";
    };
    entry.addEventListener("click", turn);
    entry.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); turn(); } });
  }
}

// A figure in a folded part is wired when it is first seen.
const seen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) if (isIntersecting) { seen.unobserve(target); wire(target); }
}, { rootMargin: "200px" });
for (const figure of document.querySelectorAll(".plot > svg")) seen.observe(figure);

// The drawings of folded parts are compressed. Their texts are read when nothing else is to do, so that they can be
// shown, and printed, at once.
const folded = new Map([...document.querySelectorAll("[data-folded]")].map((plot) => [plot, null]));
async function read(plot) {
  const bytes = Uint8Array.from(atob(plot.dataset.folded), (letter) => letter.charCodeAt(0));
  const text = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).text();
  if (folded.has(plot)) folded.set(plot, text);
}
function show(plot) {
  if (!folded.get(plot)) return;
  plot.innerHTML = folded.get(plot);
  plot.removeAttribute("data-folded");
  folded.delete(plot);
  seen.observe(plot.firstElementChild);
}
for (const part of document.querySelectorAll("details.figure"))
  part.addEventListener("toggle", async () => {
    for (const plot of part.querySelectorAll("[data-folded]")) { if (!folded.get(plot)) await read(plot); show(plot); }
  });
// What is scrolled can be scrolled by keys.
const scrollable = () => {
  for (const part of document.querySelectorAll("section, section details, .plot, .scroll, .lead > *"))
    if (part.scrollWidth > part.clientWidth) part.tabIndex = 0; else part.removeAttribute("tabindex");
};
window.addEventListener("resize", scrollable);
scrollable();
const idle = window.requestIdleCallback ?? setTimeout;
// A part that is opened meanwhile is no longer folded when its turn comes.
idle(async () => { for (const plot of [...folded.keys()]) if (folded.get(plot) === null) await read(plot); });
// A link into a folded part opens it, and paper shows the figures.
const open = (id) => { for (let part = id && document.getElementById(id); part; part = part.parentElement) if (part.tagName === "DETAILS") part.open = true; };
window.addEventListener("hashchange", () => open(location.hash.slice(1)));
open(location.hash.slice(1));
window.addEventListener("beforeprint", () => {
  for (const plot of [...folded.keys()]) show(plot);
  for (const part of document.querySelectorAll("details.figure")) part.open = true;
});
