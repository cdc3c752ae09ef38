// Curves over time as SVG: one panel with its legend, its limit and a cursor that all panels share.
//
//   const chart = new Chart(parent, panel, runs, (time) => …);   // called when a pointer asks for a time
//   chart.point(time);
//
// Curves differ by colour and by dashes. References are drawn in ink, limits in grey. A norm that has a limit is bold, the
// components that it is of are thin.
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
    // In a panel with one signal, the colour distinguishes the runs.
    this.isAlone = panel.curves.every((curve) => curve.place === panel.curves[0].place);
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
    if (curve.role === "norm" && single) return { stroke: "var(--ink)", "stroke-width": 3, "stroke-dasharray": "" };
    const colour = this.isAlone ? curve.run : curve.place;
    if (curve.role === "own reference") return { stroke: `var(--c${colour % 6})`, "stroke-width": 1, "stroke-dasharray": "1.5 2.5" };
    const dash = single ? curve.place : curve.run;
    const width = single && this.panel.limits.length ? 1 : 1.8;
    return { stroke: `var(--c${colour % 6})`, "stroke-width": width, "stroke-dasharray": Chart.DASHES[dash % 6] };
  }

  list() {
    const isReference = (curve) => curve.role.endsWith("reference");
    this.outputs = this.panel.curves.filter((curve) => !isReference(curve)).map((curve) => {
      const output = document.createElement("output");
      this.legend.append(this.entry(this.style(curve), curve.name, output));
      return [curve, output];
    });
    const references = new Map(this.panel.curves.filter(isReference).map((curve) => [curve.name, curve]));
    for (const [name, curve] of references) this.legend.append(this.entry(this.style(curve), name));
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
    const digits = Math.max(0, Math.min(100, -Math.floor(Math.log10(step))));
    const [first, last] = [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
    const values = Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
    const texts = values.map((value) => value.toFixed(digits));
    // Marks that need many letters have exponents.
    const isLong = texts.some((text) => text.length > 7);
    const short = (value) => Number(value.toPrecision(12)).toExponential().replace("e+", "e").replace("e0", "");
    return values.map((value, i) => [value, minus(isLong ? short(value) : texts[i])]);
  }

  range() {
    const { limits, curves } = this.panel;
    let [low, high] = [Infinity, -Infinity];
    for (const { value } of limits) [low, high] = [Math.min(low, value), Math.max(high, value)];
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
    const order = { norm: 0, reference: 1, "own reference": 1, signal: 2 };
    for (const curve of [...panel.curves].sort((a, b) => order[a.role] - order[b.role])) {
      svg.append(svgElement("path", { class: "curve", d: this.path(curve, y), ...this.style(curve) }));
    }
    const heights = [];
    for (const { name, value } of panel.limits) {
      svg.append(svgElement("line", { x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value), stroke: "var(--limit)", "stroke-width": 1.4, "stroke-dasharray": "6 4" }));
      // Above the line if there is no room below it.
      const isFree = (at) => at > TOP + 10 && at < HEIGHT - BOTTOM && heights.every((other) => Math.abs(other - at) >= 13);
      const at = [y(value) + 14, y(value) - 5].find(isFree) ?? y(value) + 14;
      heights.push(at);
      const text = `${name}: ${minus(String(value))} ${panel.unit}`;
      svg.append(svgElement("text", { class: "limit", x: width - RIGHT - 4, y: at, "text-anchor": "end" }, text));
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
