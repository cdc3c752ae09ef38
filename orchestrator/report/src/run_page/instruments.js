// The vehicle of a run in motion, with its surfaces and jets where there are any.
//
//   const instruments = new Instruments(element, run);
//   instruments.point(time);
"use strict";

class Instruments {
  constructor(element, { vehicle, guarantee, guaranteed }) {
    Object.assign(this, { vehicle, guarantee, guaranteed });
    this.view = new Vehicle3D(element.querySelector("canvas"));
    this.canvas = element.querySelector("canvas");
    this.surfaces = this.bars(element.querySelector(".surfaces"), vehicle.surfaces || []);
    this.jets = this.lamps(element.querySelector(".jets"), vehicle.jets || []);
  }

  static heading(text) {
    const heading = document.createElement("b");
    heading.textContent = text;
    return heading;
  }

  // A bar to either side of zero for each surface, all to the same scale.
  bars(parent, surfaces) {
    if (!surfaces.length) return [];
    const reach = Math.max(1e-9, ...surfaces.map(({ values }) => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0)));
    parent.append(Instruments.heading(`surfaces, ${surfaces[0].unit}`));
    return surfaces.map(({ name, values }) => {
      const item = document.createElement("span");
      item.className = "surface";
      const text = document.createElement("span");
      text.textContent = name;
      const svg = svgElement("svg", { viewBox: "-17 0 34 10", "aria-hidden": "true" });
      const bar = svgElement("rect", { y: 2, height: 6, fill: "var(--c0)" });
      svg.append(svgElement("rect", { x: -17, y: 2, width: 34, height: 6, fill: "var(--line)" }), bar);
      svg.append(svgElement("line", { x1: 0, x2: 0, y1: 0, y2: 10, stroke: "var(--muted)", "stroke-width": 1 }));
      const output = document.createElement("output");
      item.append(text, svg, output);
      parent.append(item);
      return (frame) => {
        const value = values[frame] ?? 0;
        const length = (17 * value) / reach;
        bar.setAttribute("x", Math.min(0, length));
        bar.setAttribute("width", Math.abs(length));
        output.textContent = minus(value.toFixed(1));
      };
    });
  }

  // A lamp for each jet, filled by the share of the time for which it is on.
  lamps(parent, jets) {
    if (!jets.length) return [];
    parent.append(Instruments.heading("jets"));
    return jets.map((values, place) => {
      const lamp = document.createElement("i");
      lamp.textContent = place + 1;
      lamp.title = `jet ${place + 1}`;
      parent.append(lamp);
      return (frame) => {
        const share = Math.max(0, Math.min(1, values[frame] ?? 0));
        lamp.style.background = `color-mix(in srgb, var(--warn) ${Math.round(100 * share)}%, transparent)`;
        lamp.style.color = share > 0.4 ? "#1b1d20" : "";
      };
    });
  }

  light(time) {
    const { guarantee, guaranteed, vehicle } = this;
    const end = vehicle.time.at(-1);
    if (time > end + 1e-6) return { state: "none", text: `ended at ${minus(end.toFixed(1))} s` };
    if (!guarantee) return { state: "none", text: guaranteed ? `guarantee over the run: ${guaranteed}` : "no guarantee recorded" };
    const row = rowAt(guarantee.time, time);
    const isInForce = guarantee.inForce[row] !== 0;
    const status = guarantee.status && guarantee.items[guarantee.status[row]];
    return { state: isInForce ? "good" : "warn", text: `guarantee: ${status || (isInForce ? "in force" : "not in force")}` };
  }

  point(time) {
    const { vehicle } = this;
    const frame = rowAt(vehicle.time, time);
    const at = (list) => (list && list.every((values) => values[frame] !== null) ? list.map((values) => values[frame]) : undefined);
    const state = { angles: at(vehicle.angles) || [0, 0, 0], light: this.light(time) };
    for (const key of ["reference", "flaps"]) if (at(vehicle[key])) state[key] = at(vehicle[key]);
    const degrees = (angle) => minus(((angle * 180) / Math.PI).toFixed(1));
    const [alpha, beta, sigma] = state.angles.map(degrees);
    this.canvas.setAttribute("aria-label", `Vehicle at ${time.toFixed(1)} s: α ${alpha}, β ${beta}, σ ${sigma} deg; ${state.light.text}`);
    this.view.show(state);
    for (const show of [...this.surfaces, ...this.jets]) show(frame);
  }
}

// The place of a run on the drawn panels of its flight.
class Places {
  constructor(panels, flight, colour) {
    this.time = flight.time;
    this.marks = [...panels].map((panel, number) => {
      const numbers = (key) => panel.dataset[key].split(" ").map(Number);
      const [[left, top, width, height], x, y] = ["frame", "x", "y"].map(numbers);
      const mark = svgElement("circle", { class: "place", r: 5.5, fill: colour });
      panel.append(mark);
      const share = (value, [low, high]) => (value - low) / (high - low);
      return (row) => {
        const [across, up] = flight.places[number].map((values) => values[row]);
        mark.setAttribute("cx", (left + width * share(across, x)).toFixed(1));
        mark.setAttribute("cy", (top + height * (1 - share(up, y))).toFixed(1));
      };
    });
  }

  point(time) {
    for (const show of this.marks) show(rowAt(this.time, time));
  }
}

// A strip that shows when the guarantee of a run is in force, below the times from `start` to `stop`.
const guaranteeStrip = ({ name, time, guarantee }, isNamed, [start, stop]) => {
  const strip = document.createElement("div");
  const add = (isIn, from, to) => {
    const part = strip.appendChild(document.createElement("i"));
    const [left, width] = [from - start, to - from].map((span) => `${(100 * span) / (stop - start || 1)}%`);
    // A loss of one tick is seen in a run of any length.
    Object.assign(part.style, { left, width: isIn ? width : `max(2px, ${width})`, background: `var(--${isIn ? "good" : "warn"})` });
  };
  const parts = guarantee.time.map((from, row) => [guarantee.inForce[row] !== 0, from, guarantee.time[row + 1] ?? time.at(-1)]);
  // Losses lie on top.
  for (const part of parts.sort(([a], [b]) => b - a)) add(...part);
  const note = document.createElement("small");
  note.textContent = `${isNamed ? `${name}: ` : ""}guarantee in force for ${guarantee.share} % of the time`;
  return [strip, note];
};

// The picture of plan, tube and bound of a run, with another one as its ghost.
const guaranteePicture = (run, other, [stop, onPoint]) => {
  const norm = ([x, y, z], factor) => x.map((_, row) => factor * Math.hypot(x[row], y[row], z[row]));
  const flown = ({ time, rates, moment }) => ({
    time, norms: [norm(rates, 180 / Math.PI), norm(moment, 1e-3)],
  });
  const { rateLimit, momentLimit } = run.vehicle;
  const picture = new GuaranteePicture(document.getElementById("plan"), onPoint);
  const ghost = other ? { name: other.name, ...flown(other.vehicle) } : null;
  if (ghost) document.getElementById("ghost").textContent = ` Dashed: ${ghost.name}.`;
  const limits = [(rateLimit * 180) / Math.PI, momentLimit * 1e-3];
  const { guarantee, vehicle: { time } } = run;
  const holds = (row) => Boolean(guarantee?.inForce[rowAt(guarantee.time, time[row])]);
  picture.show({ stop, ...flown(run.vehicle), limits, plans: run.plans, holds, ghost }, 0);
  return picture;
};
