// Curves over time on a canvas: one panel with its limits, drawn again at once when settings change.
//
//   const chart = new Chart(canvas, { title: "Body rates", unit: "deg/s", names: ["p", "q", "r"], digits: 2 }, (time) => …);
//   chart.show({ stop, time, curves: [[…], …], references: [[…], …], norm: […], limit, exceeded: [[from, to], …] }, cursor);
//   chart.point(cursor);    // time, s
//
// The three curves differ by colour and by dashes: --x, --y, --z of the canvas. References are drawn in --ink,
// limits in --muted with their name at the line. A limit is one of the norm, which is then drawn bold in --ink below the
// three, and those thin.
"use strict";

class Chart {
  static DASHES = [[], [7, 3], [2, 2.5]];
  static LEFT = 46;
  static RIGHT = 10;

  constructor(canvas, panel, onPoint) {
    Object.assign(this, { canvas, panel, data: null, cursor: null });
    const at = (event) => {
      const { left, width } = canvas.getBoundingClientRect();
      const share = (event.clientX - left - Chart.LEFT) / (width - Chart.LEFT - Chart.RIGHT);
      if (this.data) onPoint(Math.max(0, Math.min(1, share)) * this.stop());
    };
    canvas.style.touchAction = "pan-y";
    canvas.addEventListener("pointermove", (event) => { if (event.pointerType === "mouse" || event.buttons) at(event); });
    canvas.addEventListener("pointerdown", at);
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  show(data, cursor) {
    this.data = data;
    this.cursor = cursor;
    this.draw();
  }

  point(cursor) {
    this.cursor = cursor;
    this.draw();
  }

  stop() {
    return this.data.stop;
  }

  // Round steps of an axis with about `count` of them.
  static step(span, count) {
    const rough = span / count;
    const power = 10 ** Math.floor(Math.log10(rough));
    return power * ([1, 2, 5, 10].find((digit) => digit * power >= rough));
  }

  range() {
    const { curves, references = [], norm = [], limit } = this.data;
    let [low, high] = limit ? [0, limit] : [Infinity, -Infinity];
    for (const curve of [...curves, ...references, norm]) {
      for (const value of curve) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    const margin = 0.06 * (high - low) || 1;
    return [low - margin, high + margin];
  }

  draw() {
    const { canvas } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!this.data || !width || !height) return;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const context = (this.context = canvas.getContext("2d"));
    context.scale(ratio, ratio);
    const style = getComputedStyle(canvas);
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
    context.font = `12px ${style.fontFamily}`;
    const [low, high] = this.range();
    const [top, bottom] = [24, height - (this.panel.axis ? 20 : 6)];
    const [left, right] = [Chart.LEFT, width - Chart.RIGHT];
    this.x = (time) => left + ((right - left) * time) / this.stop();
    this.y = (value) => bottom - ((bottom - top) * (value - low)) / (high - low);
    this.frame(low, high, { left, right, top, bottom });
    this.lines({ left, right, top, bottom });
    this.heading(left, right);
    this.mark(top, bottom);
  }

  frame(low, high, { left, right, top, bottom }) {
    const { context, data } = this;
    for (const [from, to] of data.exceeded || []) {
      context.fillStyle = this.colour("alarm");
      context.fillRect(this.x(from), top, Math.max(1.5, this.x(to) - this.x(from)), bottom - top);
    }
    context.lineWidth = 1;
    context.textBaseline = "middle";
    context.textAlign = "right";
    const step = Chart.step(high - low, Math.max(2, (bottom - top) / 26));
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
      const y = Math.round(this.y(value)) + 0.5;
      context.strokeStyle = this.colour("line");
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(right, y);
      context.stroke();
      context.fillStyle = this.colour("muted");
      context.fillText((Math.abs(value) < step / 2 ? 0 : value).toFixed(digits).replace("-", "−"), left - 7, y);
    }
    if (!this.panel.axis) return;
    context.textBaseline = "top";
    const seconds = Chart.step(this.stop(), (right - left) / 70);
    for (let time = 0; time <= this.stop(); time += seconds) {
      context.textAlign = time === 0 ? "left" : time === this.stop() ? "right" : "center";
      context.fillText(time === 0 ? "0 s" : `${time} s`, this.x(time), bottom + 5);
    }
  }

  lines(box) {
    const { context, data } = this;
    context.save();
    context.beginPath();
    context.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    context.clip();
    context.lineJoin = "round";
    for (const curve of data.references || []) this.trace(curve, this.colour("ink"), 1, []);
    for (const { values, colour, width, dash } of this.drawn()) this.trace(values, this.colour(colour), width, dash);
    context.restore();
    if (!data.limit) return;
    context.strokeStyle = context.fillStyle = this.colour("muted");
    context.setLineDash([10, 4]);
    context.beginPath();
    context.moveTo(box.left, this.y(data.limit));
    context.lineTo(box.right, this.y(data.limit));
    context.stroke();
    context.setLineDash([]);
    context.textAlign = "right";
    context.textBaseline = "bottom";
    const digits = data.limit < 20 ? 1 : 0;
    context.fillText(`limit of ${this.panel.norm} ${data.limit.toFixed(digits)}`, box.right - 2, this.y(data.limit) - 2);
  }

  // Curves with their names and strokes; the first one lies lowest.
  drawn() {
    const { data: { curves, norm }, panel } = this;
    const drawn = curves.map((values, i) => ({
      name: panel.names[i], values, colour: "xyz"[i], width: norm ? 1 : 1.7, dash: Chart.DASHES[i],
    }));
    return norm ? [{ name: panel.norm, values: norm, colour: "ink", width: 3, dash: [] }, ...drawn] : drawn;
  }

  // A curve, thinned to its first, least, largest and last value in each column of pixels.
  trace(values, colour, width, dash) {
    const { context, data } = this;
    const count = values.length;
    const columns = Math.max(1, Math.round(this.x(this.stop()) - this.x(0)));
    const size = count / columns;
    context.beginPath();
    let begun = false;
    const to = (i) => {
      const [x, y] = [this.x(data.time[i]), this.y(values[i])];
      if (begun) context.lineTo(x, y); else context.moveTo(x, y);
      begun = true;
    };
    if (size <= 2) {
      for (let i = 0; i < count; i++) to(i);
    } else {
      for (let column = 0; column < columns; column++) {
        const [from, end] = [Math.floor(column * size), Math.min(count, Math.floor((column + 1) * size))];
        let [least, largest] = [from, from];
        for (let i = from; i < end; i++) {
          if (values[i] < values[least]) least = i;
          if (values[i] > values[largest]) largest = i;
        }
        for (const i of new Set([from, Math.min(least, largest), Math.max(least, largest), end - 1])) to(i);
      }
    }
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  row() {
    const { time } = this.data;
    const step = time[1] - time[0] || 1;
    return Math.max(0, Math.min(time.length - 1, Math.round((this.cursor ?? 0) / step)));
  }

  // Title on the left; names and values at the cursor on the right, each beside a piece of its line.
  heading(left, right) {
    const { context, panel } = this;
    const row = this.row();
    const drawn = this.drawn();
    const roomy = right - left > 100 * drawn.length + 130;
    const sample = roomy ? 20 : 14;
    context.textBaseline = "middle";
    context.textAlign = "left";
    context.fillStyle = this.colour("ink");
    context.fillText(`${panel.title}, ${panel.unit}`, left, 11);
    let x = right;
    for (const { name, values, colour, width, dash } of drawn.reverse()) {
      const value = values[row] ?? 0;
      const number = value.toFixed(Math.abs(value) < 1000 ? panel.digits : 0).replace("-", "−");
      context.textAlign = "right";
      if (roomy) context.fillText(number, x, 11);
      x -= roomy ? 50 : 0;
      context.fillText(name, x, 11);
      x -= 4 + context.measureText(name).width;
      context.beginPath();
      context.moveTo(x - sample, 11);
      context.lineTo(x, 11);
      context.strokeStyle = this.colour(colour);
      context.lineWidth = Math.max(1.5, width);
      context.setLineDash(dash);
      context.stroke();
      context.setLineDash([]);
      x -= sample + 10;
    }
  }

  mark(top, bottom) {
    if (this.cursor === null) return;
    const { context } = this;
    const x = Math.round(this.x(this.cursor)) + 0.5;
    context.strokeStyle = this.colour("ink");
    context.lineWidth = 1;
    context.globalAlpha = 0.55;
    context.beginPath();
    context.moveTo(x, top);
    context.lineTo(x, bottom);
    context.stroke();
    context.globalAlpha = 1;
  }
}
