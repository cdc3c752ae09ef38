// The guarantee as a picture: what CRMPC plans at the chosen time, how far it can be pushed off that plan, and what the
// limits leave to it.
//
//   const picture = new GuaranteePicture(canvas, (time) => …);
//   picture.show({ stop, time, norms: [rates, moments], limits: [rate, moment], plans, holds: (row) => …, ghost }, cursor);
//   picture.point(cursor);    // time, s
//
// A plan is { began, at: […], norms: [[…], […]], bounds: [[…], […]] }, with times from its beginning on. What a bound
// leaves of its limit is the tube: the flown norm differs from the plan in force by at most that much. A ghost is
// { name, time, norms }. Lines of what is flown are thick, of what is planned thin; where the guarantee does not hold,
// nothing is filled.
"use strict";

class GuaranteePicture {
  // Share of a limit up to which the axes go, whatever is flown.
  static TOP = 1.5;
  static PANELS = [{ title: "Body rate ‖ω‖", unit: "deg/s", digits: 2 }, { title: "Control moment ‖m‖", unit: "kN m", digits: 1 }];
  static LEFT = 40;
  static RIGHT = 84;

  constructor(canvas, onPoint) {
    Object.assign(this, { canvas, data: null, cursor: 0 });
    new ResizeObserver(() => this.draw()).observe(canvas);
    const at = (event) => {
      if (!this.data) return;
      const { left, top, width } = canvas.getBoundingClientRect();
      const share = (event.clientX - left - GuaranteePicture.LEFT) / (width - GuaranteePicture.LEFT - GuaranteePicture.RIGHT);
      // The window would move under the pointer, so that only the part before the cursor is dragged in it.
      const inStrip = event.clientY - top > this.strip.top - 6;
      const [from, to] = inStrip ? [0, this.data.stop] : this.pressed;
      onPoint(Math.max(0, Math.min(this.data.stop, from + share * (to - from))));
    };
    canvas.style.touchAction = "pan-y";
    canvas.addEventListener("pointerdown", (event) => {
      this.pressed = this.window();
      canvas.setPointerCapture(event.pointerId);
      at(event);
    });
    canvas.addEventListener("pointermove", (event) => { if (event.buttons) at(event); });
  }

  show(data, cursor) {
    this.data = data;
    this.point(cursor);
  }

  point(cursor) {
    this.cursor = cursor;
    this.draw();
  }

  // Clears the canvas and returns its size; nothing if there is nothing to draw.
  begin() {
    const { canvas, data } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!data || !width || !height) return null;
    const ratio = window.devicePixelRatio || 1;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    this.context = canvas.getContext("2d");
    this.context.scale(ratio, ratio);
    const style = getComputedStyle(canvas);
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
    this.context.font = `12px ${style.fontFamily}`;
    return [width, height];
  }

  row(time = this.cursor, { time: times } = this.data) {
    return rowAt(times, time);
  }

  // Index of the plan that is followed at a time; −1 before the first.
  plan(time) {
    const { plans } = this.data;
    let index = plans.length - 1;
    while (index >= 0 && plans[index].began > time + 1e-9) index--;
    return index;
  }

  path(points, width, dash = []) {
    const { context } = this;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
    context.setLineDash([]);
  }

  // First and last time that the panels show.
  window() {
    const [before, after] = this.canvas.clientWidth < 560 ? [2, 5] : [3, 9];
    const from = Math.max(0, Math.min(this.cursor - before, this.data.stop));
    return [from, from + before + after];
  }

  draw() {
    const size = this.begin();
    if (!size) return;
    const [width, height] = size;
    const [left, right] = [GuaranteePicture.LEFT, width - GuaranteePicture.RIGHT];
    const each = (height - 78) / 2;
    const [from, to] = this.window();
    this.x = (time) => left + ((right - left) * (time - from)) / (to - from);
    this.strip = { left, right, top: height - 46, bottom: height - 22 };
    GuaranteePicture.PANELS.forEach((panel, i) => {
      const top = i * each + 22;
      this.panel(panel, i, { left, right, top, bottom: top + each - 28, from, to });
    });
    this.times(from, to, 2 * each + 4, left, right);
    this.whole();
  }

  panel(panel, i, box) {
    const { context, data } = this;
    const limit = data.limits[i];
    const top = limit * GuaranteePicture.TOP;
    this.y = (value) => box.bottom - (Math.max(0, value) / top) * (box.bottom - box.top);
    this.axis(top, box);
    context.save();
    context.beginPath();
    context.rect(box.left, box.top - 1, box.right - box.left, box.bottom - box.top + 2);
    context.clip();
    const index = this.plan(this.cursor);
    const row = this.row();
    if (index >= 0) this.ahead(data.plans[index], i, limit, data.holds(row));
    this.past(index, i, limit);
    if (data.ghost) this.ghost(i, limit, box);
    context.globalAlpha = 0.5;
    this.line(data.time, data.norms[i], row, this.row(box.to), "x", 1);
    context.globalAlpha = 1;
    this.line(data.time, data.norms[i], this.row(box.from), row, "x", 2.6);
    context.restore();
    this.horizontal(limit, box, "ink", [7, 4]);
    this.label(`limit ${limit.toFixed(limit < 20 ? 1 : 0)}`, limit, box, "ink");
    context.strokeStyle = this.colour("muted");
    this.path([[this.x(this.cursor), box.top], [this.x(this.cursor), box.bottom]], 1);
    context.fillStyle = this.colour("x");
    context.beginPath();
    context.arc(this.x(this.cursor), this.y(Math.min(top, data.norms[i][row])), 4, 0, 2 * Math.PI);
    context.fill();
    this.heading(panel, i, row, box);
  }

  axis(top, box) {
    const { context } = this;
    const step = Chart.step(top, Math.max(4, (box.bottom - box.top) / 34));
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (let value = 0; value <= top * 1.001; value += step) {
      this.horizontal(value, box, "line", []);
      context.fillStyle = this.colour("muted");
      context.fillText(String(Number(value.toPrecision(6))), box.left - 7, this.y(value));
    }
  }

  horizontal(value, box, colour, dash) {
    this.context.strokeStyle = this.colour(colour);
    const y = Math.round(this.y(value)) + 0.5;
    this.path([[box.left, y], [box.right, y]], 1, dash);
  }

  label(text, value, box, colour) {
    const { context } = this;
    context.fillStyle = this.colour(colour);
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText(text, box.right + 6, this.y(value));
  }

  // Points of a quantity of a plan; the moment is held between them, so that it steps.
  points(plan, values, i, end) {
    const points = values.map((value, k) => [this.x(plan.began + plan.at[k]), this.y(value)]);
    if (i === 0) return points;
    const stepped = points.flatMap(([x, y], k) => (k ? [[x, points[k - 1][1]], [x, y]] : [[x, y]]));
    return end ? stepped : stepped.slice(0, -1);
  }

  area(upper, lower, colour, alpha) {
    const { context } = this;
    context.globalAlpha = alpha;
    context.fillStyle = this.colour(colour);
    context.beginPath();
    [...upper, ...lower.reverse()].forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.fill();
    context.globalAlpha = 1;
  }

  // The plan that is followed at the cursor, with its tube and its bound.
  ahead(plan, i, limit, holds) {
    const norms = plan.norms[i], bounds = plan.bounds[i];
    const tube = bounds.map((bound) => limit - bound);
    const of = (values) => this.points(plan, values, i);
    const upper = of(norms.map((norm, k) => norm + tube[k]));
    const lower = of(norms.map((norm, k) => Math.max(0, norm - tube[k])));
    const bound = of(bounds.map((value) => Math.max(0, value)));
    if (holds) {
      this.area(bound, of(bounds.map(() => limit)), "muted", 0.13);
      this.area([...upper], lower, "x", 0.17);
    }
    this.context.strokeStyle = this.colour("x");
    this.path(upper, 1, holds ? [] : [2, 3]);
    this.context.strokeStyle = this.colour("ink");
    this.path(bound, 1.3, holds ? [] : [2, 3]);
    this.context.strokeStyle = this.colour("x");
    this.path(of(norms), 1.5);
    // Where a plan is at its bound, its tube touches the limit.
    this.context.strokeStyle = this.colour("ink");
    for (let k = 0; holds && k + 1 < norms.length; k++) {
      const touches = [k, i ? k : k + 1].every((at) => norms[at] > bounds[at] - 0.004 * limit);
      const [from, to] = [k, k + 1].map((at) => this.x(plan.began + plan.at[at]));
      if (touches) this.path([[from, this.y(norms[k])], [to, this.y(norms[i ? k : k + 1])]], 3.2);
    }
    if (i) return;
    this.context.fillStyle = this.colour("x");
    for (const [x, y] of of(norms)) this.context.fillRect(x - 1.7, y - 1.7, 3.4, 3.4);
  }

  // The tube of each earlier plan while it was followed: the only one that has to contain the flight.
  past(index, i, limit) {
    const { plans, holds } = this.data;
    const [from] = this.window();
    for (let k = index - 1; k >= 0 && plans[k + 1].began > from; k--) {
      if (!holds(this.row(plans[k].began))) continue;
      const next = { ...plans[k], at: plans[k].at.slice(0, 2) };
      const edge = (sign) => this.points(next, [0, 1].map((at) => {
        const tube = limit - plans[k].bounds[i][at];
        return Math.max(0, plans[k].norms[i][at] + sign * tube);
      }), i);
      this.area(edge(1), edge(-1), "x", 0.17);
    }
  }

  // Another law under the same disturbance, filled where it is beyond the limit.
  ghost(i, limit, box) {
    const { context, data: { ghost } } = this;
    const [first, last] = [box.from, this.cursor].map((time) => this.row(time, ghost));
    const points = [];
    for (let row = first; row <= last; row++) points.push([this.x(ghost.time[row]), this.y(ghost.norms[i][row])]);
    const largest = ghost.norms[i].reduce((most, value, row) => (value > ghost.norms[i][most] ? row : most), 0);
    const y = this.y(limit);
    this.area(points.map(([x, at]) => [x, Math.min(at, y)]), points.map(([x]) => [x, y]), "y", 0.3);
    context.strokeStyle = this.colour("y");
    this.path(points, 1.4, [5, 3]);
    const value = ghost.norms[i][largest];
    if (value <= limit * (1 + 1e-9)) return;
    const beyond = value > limit * GuaranteePicture.TOP;
    context.textAlign = "left";
    context.textBaseline = "top";
    // The peak of the whole flight, wherever the cursor is.
    const text = `${beyond ? "▲ " : ""}${ghost.name}: up to ${value.toFixed(value < 20 ? 1 : 0)}, ${((100 * value) / limit).toFixed(0)} %`;
    const { width } = context.measureText(text);
    const x = Math.max(box.left + 4, Math.min(this.x(ghost.time[largest]) + 6, box.right - width - 4));
    const at = Math.max(box.top + 1, this.y(value) - 15);
    context.fillStyle = this.colour("paper");
    context.fillRect(x - 2, at - 1, width + 4, 15);
    context.fillStyle = this.colour("y");
    context.fillText(text, x, at);
  }

  line(time, values, from, to, colour, width) {
    this.context.strokeStyle = this.colour(colour);
    const points = [];
    for (let row = from; row <= to; row++) points.push([this.x(time[row]), this.y(values[row])]);
    this.path(points, width);
  }

  heading({ title, unit, digits }, i, row, { left, right, top }) {
    const { context, data } = this;
    context.textBaseline = "alphabetic";
    context.textAlign = "left";
    context.fillStyle = this.colour("ink");
    context.fillText(`${title}, ${unit}`, left, top - 8);
    context.textAlign = "right";
    context.fillStyle = this.colour("x");
    context.fillText(`flown ${data.norms[i][row].toFixed(digits)}`, right, top - 8);
  }

  times(from, to, y, left, right) {
    const { context } = this;
    const step = Chart.step(to - from, (right - left) / 70);
    context.textAlign = "center";
    context.textBaseline = "top";
    context.fillStyle = this.colour("muted");
    for (let time = Math.ceil(from / step) * step; time <= to; time += step) {
      context.fillText(`${Number(time.toFixed(3))} s`, this.x(time), y);
    }
  }

  // The whole flight: the larger share of a limit, and a bar that is filled where the guarantee is in force.
  whole() {
    const { context, data, strip: { left, right, top, bottom } } = this;
    const x = (time) => left + ((right - left) * time) / data.stop;
    const shares = (norms) => norms[0].map((value, row) => Math.max(value / data.limits[0], norms[1][row] / data.limits[1]));
    const y = (share) => bottom - Math.min(1.5, share) * ((bottom - top) / 1.5);
    const [from, to] = this.window();
    this.area([[x(from), top], [x(Math.min(to, data.stop)), top]], [[x(from), bottom], [x(Math.min(to, data.stop)), bottom]], "muted", 0.13);
    const draw = ({ time, norms }, colour, dash) => {
      context.strokeStyle = this.colour(colour);
      // Of the rows of a column of pixels the largest one is drawn.
      const columns = new Map();
      Array.from(shares(norms)).forEach((share, row) => {
        const column = Math.floor(x(time[row]));
        columns.set(column, Math.max(share, columns.get(column) ?? 0));
      });
      this.path([...columns].map(([column, share]) => [column, y(share)]), 1, dash);
    };
    if (data.ghost) draw(data.ghost, "y", [3, 2]);
    draw(data, "x", []);
    context.strokeStyle = this.colour("ink");
    this.path([[left, y(1)], [right, y(1)]], 1, [7, 4]);
    // A loss of one row is seen in a flight of any length.
    const { time } = data;
    const lost = Array.from(time).flatMap((at, row) => (data.holds(row) ? [] : [[x(at), Math.max(x(at) + 1.5, x(time[row + 1] ?? at))]]));
    context.fillStyle = this.colour("good");
    context.fillRect(left, bottom + 3, x(time.at(-1)) - left, 5);
    for (const [begin, end] of lost) context.clearRect(begin, bottom + 3, end - begin, 5);
    context.strokeStyle = this.colour("muted");
    context.strokeRect(left + 0.5, bottom + 3.5, right - left - 1, 4);
    this.path([[x(this.cursor), top - 3], [x(this.cursor), bottom + 10]], 1.5);
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillStyle = this.colour("muted");
    context.fillText("100 %", right + 6, y(1));
    context.fillText("guarantee", right + 6, bottom + 6);
  }
}
