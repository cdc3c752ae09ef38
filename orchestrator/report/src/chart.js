// Curves over time as SVG: one panel with its legend, its limits, and a cursor and a window of time that panels share.
//
//   const chart = new Chart(parent, {
//     onPoint: (time) => …,      // a pointer asks for a time
//     onZoom: (window) => …,     // a pointer has been dragged over [from, to]; null after a double click
//   });
//   chart.show({ label, unit, limits: [{ name, value }], curves: [{ name, role, run, place, values }], magnitudes }, runs, span);
//   chart.zoom(window);
//   chart.point(time);
//
// A run is { time, faint }. The role of a curve is "signal", "norm", "reference" or "own reference". Colours distinguish
// the signals of a run, or several runs, whose signals then have dashes; curves of a faint run are pale. References are
// drawn in ink, limits in grey. A norm that has a limit is bold, the components that it is of are thin, and where it
// exceeds the limit, the panel is shaded. `magnitudes` is the range of a logarithmic axis of magnitudes, or null.
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
    if (times[middle] <= time + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
};

// In steps of a tenth; toFixed takes several times as long.
const tenths = (value) => Math.round(10 * value) / 10;

// With the sign of typography, which zero does not have.
const minus = (text) => text.replace(/^-(?=[0.]*$)/, "").replace("-", "−");

class Chart {
  static HEIGHT = 190;
  static LEFT = 54;
  static RIGHT = 14;
  static TOP = 8;
  static BOTTOM = 22;
  static DASHES = ["", "8 3", "2.5 2.5", "10 3 2 3", "5 2", "12 4"];
  static LIMIT = { stroke: "var(--limit)", "stroke-width": 1.4, "stroke-dasharray": "6 4" };
  // Share of a limit by which values exceed it that are rounded.
  static ROUNDING = 5e-5;

  constructor(parent, { onPoint, onZoom }) {
    this.figure = document.createElement("figure");
    this.figure.className = "panel";
    this.heading = document.createElement("h2");
    this.legend = document.createElement("ul");
    this.legend.className = "legend";
    this.svg = svgElement("svg", { role: "img" });
    this.figure.append(this.heading, this.legend, this.svg);
    parent.append(this.figure);
    this.listen(onPoint, onZoom);
    new ResizeObserver(() => { if (this.panel && this.size() !== this.width) this.draw(); }).observe(this.figure);
  }

  listen(onPoint, onZoom) {
    const { svg } = this;
    let begin = null;
    // Two fingers choose the times between them, as a mouse does that is dragged.
    const fingers = new Map();
    svg.addEventListener("pointerdown", (event) => {
      begin = event.pointerType === "mouse" && event.button === 0 ? event.clientX : null;
      if (event.pointerType === "touch") fingers.set(event.pointerId, event.clientX);
      svg.setPointerCapture(event.pointerId);
      onPoint(this.timeAt(event.clientX));
    });
    svg.addEventListener("pointermove", (event) => {
      const isMouse = event.pointerType === "mouse";
      if (fingers.has(event.pointerId)) fingers.set(event.pointerId, event.clientX);
      if (fingers.size === 2) this.choose(...fingers.values());
      else if (begin !== null && Math.abs(event.clientX - begin) > 5) this.choose(begin, event.clientX);
      else if (isMouse || event.buttons) onPoint(this.timeAt(event.clientX));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      svg.addEventListener(end, (event) => {
        const chosen = this.chosen;
        begin = this.chosen = null;
        fingers.clear();
        this.box?.remove();
        if (chosen && event.type === "pointerup") onZoom(chosen);
      });
    }
    svg.addEventListener("dblclick", () => onZoom(null));
  }

  // Marks the times between two places of a pointer.
  choose(...places) {
    this.chosen = places.map((place) => this.timeAt(place)).sort((a, b) => a - b);
    const [left, right] = this.chosen.map(this.x);
    this.box ??= svgElement("rect", { class: "chosen", y: Chart.TOP, height: Chart.HEIGHT - Chart.TOP - Chart.BOTTOM });
    this.box.setAttribute("x", left);
    this.box.setAttribute("width", right - left);
    this.svg.append(this.box);
  }

  timeAt(place) {
    const { left, width } = this.svg.getBoundingClientRect();
    const x = ((place - left) * this.width) / width;
    const share = (x - Chart.LEFT) / (this.width - Chart.LEFT - Chart.RIGHT);
    const [from, to] = this.window;
    return from + Math.max(0, Math.min(1, share)) * (to - from);
  }

  show(panel, runs, span) {
    Object.assign(this, { panel, runs, span });
    this.window = this.zoomed ?? span;
    this.isSingle = runs.filter((run) => !run.faint).length === 1;
    this.list();
    this.draw();
  }

  zoom(window) {
    this.zoomed = window;
    this.window = window ?? this.span;
    if (this.panel) this.draw();
  }

  style(curve) {
    const isFaint = this.runs[curve.run].faint;
    const pale = isFaint ? { opacity: 0.42 } : {};
    if (curve.role === "reference") return { stroke: "var(--ink)", "stroke-width": 1, "stroke-dasharray": "1.5 2.5", ...pale };
    if (curve.role === "norm" && this.isSingle) return { stroke: "var(--ink)", "stroke-width": isFaint ? 2 : 3, "stroke-dasharray": "", ...pale };
    const colour = this.isSingle ? curve.place : curve.run;
    if (curve.role === "own reference") return { stroke: `var(--c${colour % 6})`, "stroke-width": 1, "stroke-dasharray": "1.5 2.5" };
    const width = isFaint || (this.isSingle && this.panel.curves.some(({ role }) => role === "norm")) ? 1 : 1.8;
    return { stroke: `var(--c${colour % 6})`, "stroke-width": width, "stroke-dasharray": Chart.DASHES[curve.place % 6], ...pale };
  }

  // The legend, unless it is there already.
  list() {
    const { label, unit, limits, curves } = this.panel;
    const told = JSON.stringify([label, unit, limits, curves.map((curve) => [curve.name, this.style(curve)])]);
    const isReference = (curve) => curve.role.endsWith("reference");
    const valued = curves.filter((curve) => !isReference(curve) && !this.runs[curve.run].faint);
    if (told !== this.told) {
      this.told = told;
      this.heading.textContent = [label, unit].filter(Boolean).join(", ");
      this.svg.setAttribute("aria-label", `${this.heading.textContent} over time`);
      this.written = valued.map(() => document.createElement("output"));
      const references = new Map(curves.filter(isReference).map((curve) => [curve.name, curve]));
      this.legend.replaceChildren(
        ...valued.map((curve, i) => this.entry(this.style(curve), curve.name, this.written[i])),
        ...[...references].map(([name, curve]) => this.entry(this.style(curve), name)),
        ...limits.map(({ name, value }) => this.entry(Chart.LIMIT, `${name}: ${minus(String(Number(value.toPrecision(4))))} ${unit}`)),
      );
    }
    this.outputs = valued.map((curve, i) => [curve, this.written[i]]);
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
    // An axis has three marks at least.
    const finer = [1, 2, 4, 8].map((times) => Chart.step(high - low, times * count));
    const step = finer.find((step) => Math.floor(high / step + 1e-9) - Math.ceil(low / step - 1e-9) >= 2) ?? finer[0];
    const digits = Math.max(0, Math.min(100, -Math.floor(Math.log10(step))));
    const [first, last] = [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
    const values = Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
    const texts = values.map((value) => value.toFixed(digits));
    // Marks that need many letters have exponents.
    const isLong = texts.some((text) => text.length > 7);
    const short = (value) => Number(value.toPrecision(12)).toExponential().replace("e+", "e").replace("e0", "");
    return values.map((value, i) => [value, minus(isLong ? short(value) : texts[i])]);
  }

  // Powers of ten within a range, with 2 and 5 times them if there are few.
  static powers(low, high) {
    const multiples = high / low > 1e3 ? [1] : [1, 2, 5];
    const values = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) values.push(...multiples.map((m) => m * 10 ** power));
    return values.filter((value) => value >= low && value <= high).map((value) => [value, String(Number(value.toPrecision(3)))]);
  }

  // Least and largest value in the window, with room around them.
  range() {
    const { limits, curves, magnitudes } = this.panel;
    const values = limits.map(({ value }) => value);
    let [low, high] = values.length ? [Math.min(...values), Math.max(...values)] : [Infinity, -Infinity];
    // What a limit is drawn for, is not made small by what it is compared with.
    const isCompared = limits.length > 0 && this.runs.some((run) => run.faint);
    if (isCompared) high *= 1.3;
    for (const curve of curves) {
      if (isCompared && this.runs[curve.run].faint) continue;
      const [from, to] = this.rows(curve);
      for (let row = from; row <= to; row++) {
        const value = curve.values[row];
        if (value === null) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    // Values at the cursor have the digits of the largest one.
    this.digits = low > high ? 0 : Math.max(0, Math.min(9, 3 - Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high)) || 1))));
    if (magnitudes) return magnitudes;
    if (low > high) return [0, 1];
    const margin = 0.06 * (high - low) || 0.06 * Math.abs(high) || 1;
    return [low - margin, high + margin];
  }

  // First and last row of a curve that the window needs.
  rows(curve) {
    const times = this.runs[curve.run].time;
    const [from, to] = this.window;
    return [rowAt(times, from), Math.min(times.length - 1, curve.values.length - 1, rowAt(times, to) + 1)];
  }

  size() {
    return Math.max(240, Math.round(this.figure.clientWidth));
  }

  draw() {
    const { LEFT, RIGHT, TOP, BOTTOM, HEIGHT } = Chart;
    const width = (this.width = this.size());
    const [low, high] = this.range();
    const [from, to] = this.window;
    this.x = (time) => LEFT + ((width - LEFT - RIGHT) * (time - from)) / (to - from || 1);
    const { svg, panel } = this;
    const share = panel.magnitudes
      ? (value) => Math.log(Math.max(Math.abs(value), low) / low) / Math.log(high / low)
      : (value) => (value - low) / (high - low);
    const y = (value) => HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share(value);
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    for (const [start, end] of this.exceeded()) {
      const wide = Math.max(1.5, this.x(end) - this.x(start));
      svg.append(svgElement("rect", { class: "beyond", x: this.x(start), y: TOP, width: wide, height: HEIGHT - TOP - BOTTOM }));
    }
    for (const [value, text] of panel.magnitudes ? Chart.powers(low, high) : Chart.ticks(low, high, 5)) {
      svg.append(svgElement("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value) }));
      svg.append(svgElement("text", { x: LEFT - 7, y: y(value) + 4, "text-anchor": "end" }, text));
    }
    const times = Chart.ticks(from, to, Math.max(3, width / 110));
    times.forEach(([value, text], i) => {
      const label = i === times.length - 1 ? `${text} s` : text;
      svg.append(svgElement("line", { class: "grid", x1: this.x(value), x2: this.x(value), y1: TOP, y2: HEIGHT - BOTTOM }));
      svg.append(svgElement("text", { x: Math.min(this.x(value), width - 22), y: HEIGHT - 6, "text-anchor": "middle" }, label));
    });
    const [wide, tall] = [width - LEFT - RIGHT, HEIGHT - TOP - BOTTOM];
    const inside = svgElement("svg", { x: LEFT, y: TOP, width: wide, height: tall, viewBox: `${LEFT} ${TOP} ${wide} ${tall}`, overflow: "hidden" });
    // Norms lie lowest, signals on top of what they follow, and all on top of what they are compared with.
    const order = { norm: 0, reference: 1, "own reference": 1, signal: 2 };
    const place = (curve) => order[curve.role] - (this.runs[curve.run].faint ? 3 : 0);
    for (const curve of [...panel.curves].sort((a, b) => place(a) - place(b))) {
      inside.append(svgElement("path", { class: "curve", d: this.path(curve, y), ...this.style(curve) }));
    }
    svg.append(inside);
    for (const { value } of panel.limits) {
      svg.append(svgElement("line", { x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value), ...Chart.LIMIT }));
    }
    this.line = svgElement("line", { class: "cursor", x1: LEFT, x2: LEFT, y1: TOP, y2: HEIGHT - BOTTOM });
    svg.append(this.line);
    if (this.time !== undefined) this.point(this.time);
  }

  // Times between which the norm exceeds its limit.
  exceeded() {
    const { limits, curves } = this.panel;
    const norm = curves.find((curve) => curve.role === "norm" && !this.runs[curve.run].faint);
    if (!this.isSingle || !norm || limits.length !== 1) return [];
    const { time } = this.runs[norm.run];
    const [from, to] = this.rows(norm);
    const spans = [];
    for (let row = from; row <= to; row++) {
      if (!(norm.values[row] > limits[0].value * (1 + Chart.ROUNDING))) continue;
      const [begin, end] = [Math.max(time[row], this.window[0]), Math.min(time[row + 1] ?? time[row], this.window[1])];
      if (begin > end) continue;
      if (spans.length && spans.at(-1)[1] >= begin) spans.at(-1)[1] = end;
      else spans.push([begin, end]);
    }
    return spans;
  }

  // A curve, thinned to its first, least, largest and last value in each column of pixels.
  path(curve, y) {
    const times = this.runs[curve.run].time;
    const { values } = curve;
    const [from, to] = this.rows(curve);
    let [text, pen] = ["", "M"];
    const add = (row) => {
      if (values[row] === null) { pen = "M"; return; }
      text += `${pen}${tenths(this.x(times[row]))} ${tenths(y(values[row]))}`;
      pen = "L";
    };
    if (to - from < 2 * this.width) {
      for (let row = from; row <= to; row++) add(row);
      return text;
    }
    for (let row = from; row <= to;) {
      const column = Math.floor(this.x(times[row]));
      const first = row;
      let [least, largest] = [row, row];
      for (; row <= to && Math.floor(this.x(times[row])) === column; row++) {
        if (values[row] < values[least]) least = row;
        if (values[row] > values[largest]) largest = row;
      }
      for (const one of new Set([first, Math.min(least, largest), Math.max(least, largest), row - 1])) add(one);
    }
    return text;
  }

  point(time) {
    this.time = time;
    if (!this.line) return;
    const [from, to] = this.window;
    this.line.style.display = time < from || time > to ? "none" : "";
    for (const end of ["x1", "x2"]) this.line.setAttribute(end, this.x(time).toFixed(1));
    for (const [curve, output] of this.outputs) {
      const times = this.runs[curve.run].time;
      const value = time > times.at(-1) + 1e-9 ? null : curve.values[rowAt(times, time)];
      output.textContent = value === null || value === undefined ? "–" : minus(value.toFixed(this.digits));
    }
  }
}
