// The vehicle of a run in motion, with its surfaces and jets where there are any.
//
//   const instruments = new Instruments(element, run.vehicle);
//   instruments.point(time);
"use strict";

class Instruments {
  constructor(element, vehicle) {
    this.vehicle = vehicle;
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
    return surfaces.map(({ name, values }, place) => {
      const item = document.createElement("span");
      item.className = "surface";
      item.title = name;
      const number = document.createElement("span");
      number.textContent = (name.match(/\[(\d+)\]/) || [0, place + 1])[1];
      const svg = svgElement("svg", { viewBox: "-17 0 34 10", "aria-hidden": "true" });
      const bar = svgElement("rect", { y: 2, height: 6, fill: "var(--c0)" });
      svg.append(svgElement("rect", { x: -17, y: 2, width: 34, height: 6, fill: "var(--line)" }), bar);
      svg.append(svgElement("line", { x1: 0, x2: 0, y1: 0, y2: 10, stroke: "var(--muted)", "stroke-width": 1 }));
      const output = document.createElement("output");
      item.append(number, svg, output);
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
      parent.append(lamp);
      return (frame) => {
        const share = Math.max(0, Math.min(1, values[frame] ?? 0));
        lamp.style.background = `color-mix(in srgb, var(--warn) ${Math.round(100 * share)}%, transparent)`;
        lamp.style.color = share > 0.4 ? "#1b1d20" : "";
      };
    });
  }

  light(frame) {
    const { guarantee } = this.vehicle;
    if (!guarantee) return { state: "none", text: "no guarantee recorded" };
    const isInForce = guarantee.inForce[frame] !== 0;
    const status = guarantee.status && guarantee.items[guarantee.status[frame]];
    return { state: isInForce ? "good" : "warn", text: `guarantee: ${status || (isInForce ? "in force" : "not in force")}` };
  }

  point(time) {
    const { vehicle } = this;
    const frame = rowAt(vehicle.time, time);
    const at = (list) => (list && list.every((values) => values[frame] !== null) ? list.map((values) => values[frame]) : undefined);
    const state = { angles: at(vehicle.angles) || [0, 0, 0], light: this.light(frame) };
    for (const key of ["reference", "flaps"]) if (at(vehicle[key])) state[key] = at(vehicle[key]);
    for (const [key, limit] of [["rates", "rateLimit"], ["moment", "momentLimit"]]) {
      if (at(vehicle[key]) && vehicle[limit]) {
        // The values are rounded: one that lies at its limit may seem to lie beyond it.
        Object.assign(state, { [key]: at(vehicle[key]), [limit]: vehicle[limit] * (1 + 5e-5) });
      }
    }
    const degrees = (angle) => minus(((angle * 180) / Math.PI).toFixed(1));
    const [alpha, beta, sigma] = state.angles.map(degrees);
    this.canvas.setAttribute("aria-label", `Vehicle at ${time.toFixed(1)} s: α ${alpha}, β ${beta}, σ ${sigma} deg; ${state.light.text}`);
    this.view.show(state);
    for (const show of [...this.surfaces, ...this.jets]) show(frame);
  }
}
