// Figures of a page: names in a legend hide their curves, a pointer shows values, a dragged rectangle
// is enlarged, and a double click shows everything again.
"use strict";
const SVG = "http://www.w3.org/2000/svg";
const numbers = (text) => text.split(" ").map(Number);

// Round values within a range, about `count` of them; powers of ten on a logarithmic axis.
function marks(low, high, count, logarithmic) {
  if (logarithmic) {
    const all = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
      for (const m of high / low > 1e3 ? [1] : [1, 2, 5]) all.push(m * 10 ** power);
    return all.filter((value) => value >= low && value <= high);
  }
  const rough = (high - low) / count, decade = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((one) => one * decade >= rough * 0.999) * decade;
  const all = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k++) all.push(k * step);
  return all;
}

// Texts of marks, each with its range, with the digits that distinguish them; with exponents if they need many letters.
function labels(values, range) {
  const power = (value) => Math.floor(Math.log10(Math.abs(value)));
  const rounded = values.map((value) => {
    const digits = power(value) - power(range(value)) + 3;
    return digits >= -5 ? Number(value.toPrecision(Math.min(17, Math.max(1, digits)))) : 0;
  });
  const long = rounded.some((value) => String(value).length > 7);
  return rounded.map((value) => (long && value ? value.toExponential().replace("e+", "e") : String(value)).replaceAll("-", "−"));
}

// A panel's axes. Coordinates are those of the figure, px.
class Panel {
  constructor(group) {
    this.group = group;
    this.curves = group.querySelector("svg.curves");
    [this.x, this.y, this.width, this.height] = numbers(group.dataset.frame);
    this.log = "log" in group.dataset;
    const ends = numbers(group.dataset.x);
    this.whole = [this.log ? ends.map(Math.log10) : ends, numbers(group.dataset.y)];
    this.shown = this.whole;
  }

  // Value at a coordinate of the whole range, along x (0) or y (1).
  value(at, axis, ends = this.whole[axis]) {
    const share = axis === 0 ? (at - this.x) / this.width : 1 - (at - this.y) / this.height;
    return ends[0] + share * (ends[1] - ends[0]);
  }

  // Coordinate of a value in what is shown.
  place(value, axis) {
    const [low, high] = this.shown[axis];
    const share = (value - low) / (high - low);
    return axis === 0 ? this.x + share * this.width : this.y + (1 - share) * this.height;
  }

  show(ranges) {
    this.shown = ranges;
    const all = (value, axis) => {
      const [low, high] = this.whole[axis];
      const share = (value - low) / (high - low);
      return axis === 0 ? this.x + share * this.width : this.y + (1 - share) * this.height;
    };
    const [[left, right], [bottom, top]] = ranges;
    const box = [all(left, 0), all(top, 1), all(right, 0) - all(left, 0), all(bottom, 1) - all(top, 1)];
    this.curves.setAttribute("viewBox", box.join(" "));
    this.redraw("marks-x", 0, left, right);
    this.redraw("marks-y", 1, bottom, top);
    for (const name of this.group.querySelectorAll(".limit-name")) name.style.display = ranges === this.whole ? "" : "none";
  }

  redraw(kind, axis, low, high) {
    const group = this.group.querySelector("." + kind);
    group.replaceChildren();
    const isLog = this.log && axis === 0, back = (value) => (isLog ? 10 ** value : value);
    const count = Math.max(2, Math.floor(axis === 0 ? this.width / 80 : this.height / 38));
    const all = marks(back(low), back(high), count, isLog), texts = labels(all, (mark) => (isLog ? mark : high - low));
    all.forEach((mark, place) => {
      const at = this.place(isLog ? Math.log10(mark) : mark, axis);
      const line = group.appendChild(document.createElementNS(SVG, "path")), text = group.appendChild(document.createElementNS(SVG, "text"));
      line.setAttribute("class", "grid");
      line.setAttribute("d", axis === 0 ? `M${at} ${this.y}v${this.height}` : `M${this.x} ${at}h${this.width}`);
      text.setAttribute("class", "small");
      text.setAttribute("x", axis === 0 ? at : this.x - 6);
      text.setAttribute("y", axis === 0 ? this.y + this.height + 15 : at + 4);
      text.textContent = texts[place];
    });
  }

  // Lines with their points in coordinates of the whole range, read once.
  lines() {
    this.read ??= [...this.curves.querySelectorAll("path[data-name][fill=none]:not(.limit)")].map((path) => {
      const values = path.getAttribute("d").match(/-?[\d.]+/g).map(Number), points = [];
      for (let k = 0, x = 0, y = 0; k + 1 < values.length; k += 2) points.push([(x += values[k]), (y += values[k + 1])]);
      return { path, points };
    });
    return this.read;
  }

  // Names and values of the lines at a coordinate of the whole range.
  values(at) {
    const found = [];
    for (const { path, points } of this.lines()) {
      if (path.style.display === "none" || at < points[0][0] || at > points[points.length - 1][0]) continue;
      let low = 0, high = points.length - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (points[middle][0] <= at) low = middle; else high = middle; }
      const [[x, y], [next, other]] = [points[low], points[high]];
      found.push([path.dataset.name, this.value(next > x ? y + ((other - y) * (at - x)) / (next - x) : y, 1)]);
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
  const line = document.createElementNS(SVG, "path"), box = document.createElementNS(SVG, "rect");
  line.setAttribute("class", "cursor");
  box.setAttribute("class", "chosen");
  let begin = null;
  figure.addEventListener("pointermove", (event) => {
    const at = where(event), panel = begin?.panel ?? under(at);
    line.remove();
    note.hidden = true;
    if (!panel) return;
    if (begin) {
      const [left, right] = [begin.at.x, at.x].sort((a, b) => a - b), [top, bottom] = [begin.at.y, at.y].sort((a, b) => a - b);
      for (const [name, value] of Object.entries({ x: left, y: top, width: right - left, height: bottom - top })) box.setAttribute(name, value);
      figure.append(box);
      return;
    }
    const x = panel.value(at.x, 0, panel.shown[0]), [low, high] = panel.whole[0];
    const found = panel.values(panel.x + ((x - low) / (high - low)) * panel.width);
    if (!found.length) return;
    line.setAttribute("d", `M${at.x} ${panel.y}v${panel.height}`);
    figure.append(line);
    const shown = (value) => Number(value.toPrecision(4)).toString().replace("-", "−");
    note.textContent = [`at ${shown(panel.log ? 10 ** x : x)}`, ...found.slice(0, 12).map(([name, value]) => `${name}: ${shown(value)}`)].join("\n");
    note.hidden = false;
    const frame = figure.parentElement.getBoundingClientRect();
    const left = event.clientX - frame.left + figure.parentElement.scrollLeft;
    note.style.left = `${left > frame.width * 0.6 ? left - note.offsetWidth - 14 : left + 14}px`;
    note.style.top = `${event.clientY - frame.top + 12}px`;
  });
  figure.addEventListener("pointerleave", () => { line.remove(); note.hidden = true; });
  figure.addEventListener("pointerdown", (event) => {
    const at = where(event), panel = under(at);
    if (panel && event.pointerType === "mouse" && event.button === 0) begin = { at, panel };
  });
  window.addEventListener("pointerup", (event) => {
    if (!begin) return;
    const { at: from, panel } = begin, to = where(event);
    begin = null;
    box.remove();
    if (Math.abs(to.x - from.x) < 6 || Math.abs(to.y - from.y) < 6) return;
    const along = (axis, a, b) => [panel.value(a, axis, panel.shown[axis]), panel.value(b, axis, panel.shown[axis])].sort((c, d) => c - d);
    panel.show([along(0, from.x, to.x), along(1, from.y, to.y)]);
  });
  figure.addEventListener("dblclick", () => panels.forEach((panel) => panel.show(panel.whole)));
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
