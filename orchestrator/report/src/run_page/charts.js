// Curves over time as SVG: one panel with its legend, its limit and a cursor that all panels share.
//
//   const chart = new Chart(parent, panel, runs, (time) => …);   // called when a pointer asks for a time
//   chart.point(time);
//
// Curves differ by colour and by dashes. References are drawn in ink, norms and limits in grey.
"use strict";

const svgElement = (name, attributes = {}, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
};

// Row whose time is the last one up to `time`.
const rowAt = (times, time) => {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
};

// With the sign of typography, which zero does not have.
const minus = (text) => text.replace(/^-(?=[0.]*$)/, "").replace("-", "−");

class Chart {
  static HEIGHT = 190;
  static LEFT = 54;
  static RIGHT = 14;
  static TOP = 8;
  static BOTTOM = 22;
  static DASHES = ["", "8 3", "2.5 2.5", "10 3 2 3", "5 2", "12 4"];

  constructor(parent, panel, runs, onPoint) {
    Object.assign(this, { panel, runs });
    const times = runs.flatMap((run) => [run.time[0], run.time.at(-1)]);
    this.span = [Math.min(...times), Math.max(...times)];
    // In a panel with one signal, the colour tells the runs apart.
    this.isAlone = panel.curves.every((curve) => curve.place === panel.curves[0].place && curve.role !== "reference");
    this.figure = document.createElement("figure");
    this.figure.className = "panel";
    const heading = document.createElement("h3");
    heading.textContent = [panel.label, panel.unit].filter(Boolean).join(", ");
    this.legend = document.createElement("ul");
    this.legend.className = "legend";
    this.svg = svgElement("svg", { role: "img", "aria-label": `${heading.textContent} over time` });
    this.figure.append(heading, this.legend, this.svg);
    parent.append(this.figure);
    this.list();
    const ask = (event) => onPoint(this.timeAt(event));
    this.svg.addEventListener("pointermove", (event) => { if (event.pointerType === "mouse" || event.buttons) ask(event); });
    this.svg.addEventListener("pointerdown", ask);
    new ResizeObserver(() => this.draw()).observe(this.figure);
  }

  timeAt(event) {
    const { left, width } = this.svg.getBoundingClientRect();
    const x = ((event.clientX - left) * this.width) / width;
    const share = (x - Chart.LEFT) / (this.width - Chart.LEFT - Chart.RIGHT);
    return this.span[0] + Math.max(0, Math.min(1, share)) * (this.span[1] - this.span[0]);
  }

  style(curve) {
    const single = this.runs.length === 1;
    if (curve.role === "reference") return { stroke: "var(--ink)", "stroke-width": 1, "stroke-dasharray": "1.5 2.5" };
    if (curve.role === "norm" && single) return { stroke: "var(--limit)", "stroke-width": 1.2, "stroke-dasharray": "" };
    const colour = this.isAlone ? curve.run : curve.place;
    const dash = single ? curve.place : curve.run;
    return { stroke: `var(--c${colour % 6})`, "stroke-width": 1.8, "stroke-dasharray": Chart.DASHES[dash % 6] };
  }

  list() {
    const shown = this.panel.curves.filter((curve) => curve.role !== "reference");
    const references = this.panel.curves.filter((curve) => curve.role === "reference");
    this.outputs = shown.map((curve) => {
      const name = this.runs.length === 1 ? curve.name : `${curve.name}, ${this.runs[curve.run].name}`;
      const output = document.createElement("output");
      this.legend.append(this.entry(this.style(curve), name, output));
      return [curve, output];
    });
    if (references.length) this.legend.append(this.entry(this.style(references[0]), "reference"));
  }

  entry(style, name, output) {
    const item = document.createElement("li");
    const swatch = svgElement("svg", { viewBox: "0 0 24 8", "aria-hidden": "true" });
    swatch.append(svgElement("line", { x1: 0, x2: 24, y1: 4, y2: 4, ...style }));
    const text = document.createElement("span");
    text.textContent = name;
    item.append(swatch, text, ...(output ? [output] : []));
    return item;
  }

  // Round steps of an axis with about `count` of them.
  static step(span, count) {
    const rough = span / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    return power * [1, 2, 5, 10].find((digit) => digit * power >= rough * (1 - 1e-9));
  }

  static ticks(low, high, count) {
    const step = Chart.step(high - low, count);
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    const ticks = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) ticks.push([i * step, minus((i * step).toFixed(digits))]);
    return ticks;
  }

  range() {
    const { limit, curves } = this.panel;
    let [low, high] = limit === null ? [Infinity, -Infinity] : [limit, limit];
    for (const curve of curves) {
      for (const value of curve.values) {
        if (value === null) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    // Values at the cursor have the digits of the largest one.
    this.digits = low > high ? 0 : Math.max(0, Math.min(9, 3 - Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high)) || 1))));
    if (low > high) return [0, 1];
    const margin = 0.06 * (high - low) || 0.06 * Math.abs(high) || 1;
    return [low - margin, high + margin];
  }

  draw() {
    const width = Math.max(240, Math.round(this.figure.clientWidth));
    if (width === this.width) return;
    this.width = width;
    const { LEFT, RIGHT, TOP, BOTTOM, HEIGHT } = Chart;
    const [low, high] = this.range();
    const [from, to] = this.span;
    this.x = (time) => LEFT + ((width - LEFT - RIGHT) * (time - from)) / (to - from || 1);
    const y = (value) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * (value - low)) / (high - low);
    const { svg, panel } = this;
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    for (const [value, text] of Chart.ticks(low, high, 5)) {
      svg.append(svgElement("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value) }));
      svg.append(svgElement("text", { x: LEFT - 7, y: y(value) + 4, "text-anchor": "end" }, text));
    }
    const times = Chart.ticks(from, to, Math.max(3, width / 110));
    times.forEach(([value, text], i) => {
      const label = i === times.length - 1 ? `${text} s` : text;
      svg.append(svgElement("line", { class: "grid", x1: this.x(value), x2: this.x(value), y1: TOP, y2: HEIGHT - BOTTOM }));
      svg.append(svgElement("text", { x: Math.min(this.x(value), width - 22), y: HEIGHT - 6, "text-anchor": "middle" }, label));
    });
    // Norms lie lowest, signals on top of what they follow.
    const order = { norm: 0, reference: 1, signal: 2 };
    for (const curve of [...panel.curves].sort((a, b) => order[a.role] - order[b.role])) {
      svg.append(svgElement("path", { class: "curve", d: this.path(curve, y), ...this.style(curve) }));
    }
    if (panel.limit !== null) {
      svg.append(svgElement("line", { x1: LEFT, x2: width - RIGHT, y1: y(panel.limit), y2: y(panel.limit), stroke: "var(--limit)", "stroke-width": 1.4, "stroke-dasharray": "6 4" }));
      svg.append(svgElement("text", { class: "limit", x: width - RIGHT - 4, y: y(panel.limit) + 14, "text-anchor": "end" }, `limit of norm ${minus(String(panel.limit))} ${panel.unit}`));
    }
    this.line = svgElement("line", { class: "cursor", x1: LEFT, x2: LEFT, y1: TOP, y2: HEIGHT - BOTTOM });
    svg.append(this.line);
    if (this.time !== undefined) this.point(this.time);
  }

  path(curve, y) {
    const times = this.runs[curve.run].time;
    let [text, pen] = ["", "M"];
    curve.values.forEach((value, row) => {
      if (value === null) {
        pen = "M";
        return;
      }
      text += `${pen}${this.x(times[row]).toFixed(1)} ${y(value).toFixed(1)}`;
      pen = "L";
    });
    return text;
  }

  point(time) {
    this.time = time;
    if (!this.line) return;
    for (const end of ["x1", "x2"]) this.line.setAttribute(end, this.x(time).toFixed(1));
    for (const [curve, output] of this.outputs) {
      const times = this.runs[curve.run].time;
      const value = time > times.at(-1) + 1e-9 ? null : curve.values[rowAt(times, time)];
      output.textContent = value === null ? "–" : minus(value.toFixed(this.digits));
    }
  }
}
