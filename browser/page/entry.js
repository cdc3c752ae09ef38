// The pictures of an entry flight: altitude over speed with its corridor, and the ground track with the coasts of the Earth.
//
//   const pictures = new EntryPictures(parent, (time) => …);
//   pictures.show({ time, of: (column) => values, limits: { heatFlux, load, pressure }, planet: { radius, gravitation },
//     target: [longitude, latitude] });
//   pictures.point(time);
"use strict";

// Values over values as SVG, with a mark at the chosen time.
class Plane {
  static HEIGHT = 300;
  static LEFT = 46;
  static BOTTOM = 36;
  static TOP = 8;
  static RIGHT = 12;

  constructor(parent, heading, onPoint) {
    this.figure = document.createElement("figure");
    this.figure.className = "panel";
    const title = document.createElement("h2");
    title.textContent = heading;
    this.legend = document.createElement("ul");
    this.legend.className = "legend";
    this.svg = svgElement("svg", { role: "img", "aria-label": heading });
    this.figure.append(title, this.legend, this.svg);
    parent.append(this.figure);
    const at = (event) => {
      if (!this.data || !(event.pointerType === "mouse" || event.buttons)) return;
      const { left, top, width } = this.svg.getBoundingClientRect();
      const scale = this.width / width;
      onPoint(this.nearest((event.clientX - left) * scale, (event.clientY - top) * scale));
    };
    this.svg.addEventListener("pointermove", at);
    this.svg.addEventListener("pointerdown", at);
    new ResizeObserver(() => { if (this.data && this.size() !== this.width) this.draw(); }).observe(this.figure);
  }

  // Data: { labels: [across, up], ranges: [[low, high], …], equal, curves: [{ name, points, style }], marks, time, path }.
  show(data) {
    this.data = data;
    this.draw();
  }

  size() {
    return Math.max(240, Math.round(this.figure.clientWidth));
  }

  nearest(x, y) {
    const { path, time } = this.data;
    let [best, at] = [Infinity, 0];
    path.forEach(([across, up], row) => {
      const away = (this.x(across) - x) ** 2 + (this.y(up) - y) ** 2;
      if (away < best) [best, at] = [away, time[row]];
    });
    return at;
  }

  draw() {
    const { LEFT, RIGHT, TOP, BOTTOM, HEIGHT } = Plane;
    const { svg, data } = this;
    const width = (this.width = this.size());
    const [wide, tall] = [width - LEFT - RIGHT, HEIGHT - TOP - BOTTOM];
    let [[left, right], [low, high]] = data.ranges;
    if (data.equal) {
      // A degree of longitude is as long as on the ground.
      const shrink = Math.cos((low + high) / 2 / DEG);
      const span = Math.max((right - left) * shrink / wide, (high - low) / tall);
      const [across, up] = [(span * wide) / shrink / 2, (span * tall) / 2];
      [left, right] = [(left + right) / 2 - across, (left + right) / 2 + across];
      [low, high] = [(low + high) / 2 - up, (low + high) / 2 + up];
    }
    this.x = (value) => LEFT + (wide * (value - left)) / (right - left);
    this.y = (value) => TOP + tall - (tall * (value - low)) / (high - low);
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    for (const [value, text] of Chart.ticks(left, right, Math.max(3, wide / 90))) {
      svg.append(svgElement("line", { class: "grid", x1: this.x(value), x2: this.x(value), y1: TOP, y2: TOP + tall }));
      svg.append(svgElement("text", { x: this.x(value), y: TOP + tall + 15, "text-anchor": "middle" }, text));
    }
    for (const [value, text] of Chart.ticks(low, high, 6)) {
      svg.append(svgElement("line", { class: "grid", x1: LEFT, x2: width - RIGHT, y1: this.y(value), y2: this.y(value) }));
      svg.append(svgElement("text", { x: LEFT - 6, y: this.y(value) + 4, "text-anchor": "end" }, text));
    }
    svg.append(svgElement("text", { x: LEFT + wide / 2, y: HEIGHT - 4, "text-anchor": "middle" }, data.labels.join(" · ")));
    const inside = svgElement("svg", { x: LEFT, y: TOP, width: wide, height: tall, viewBox: `${LEFT} ${TOP} ${wide} ${tall}`, overflow: "hidden" });
    for (const { points, style } of data.curves) inside.append(svgElement("path", { class: "curve", d: this.line(points), ...style }));
    for (const { at, style } of data.marks) inside.append(svgElement("circle", { cx: this.x(at[0]), cy: this.y(at[1]), ...style }));
    this.mark = svgElement("circle", { r: 5.5, fill: "var(--accent)", stroke: "var(--paper)", "stroke-width": 1.5 });
    inside.append(this.mark);
    svg.append(inside);
    this.legend.replaceChildren(...[...data.curves, ...data.marks].filter(({ name }) => name).map(({ name, style, points }) => {
      const item = document.createElement("li");
      const swatch = svgElement("svg", { viewBox: "0 0 24 8", "aria-hidden": "true" });
      swatch.append(points ? svgElement("line", { x1: 0, x2: 24, y1: 4, y2: 4, ...style }) : svgElement("circle", { cx: 12, cy: 4, ...style, r: 3.5 }));
      item.append(swatch, name);
      return item;
    }));
    if (this.at !== undefined) this.point(this.at);
  }

  line(points) {
    let [text, pen] = ["", "M"];
    for (const [across, up] of points) {
      if (!Number.isFinite(across) || !Number.isFinite(up)) { pen = "M"; continue; }
      text += `${pen}${this.x(across).toFixed(1)} ${this.y(up).toFixed(1)}`;
      pen = "L";
    }
    return text;
  }

  point(time) {
    this.at = time;
    if (!this.mark) return;
    const [across, up] = this.data.path[rowAt(this.data.time, time)];
    this.mark.setAttribute("cx", this.x(across).toFixed(1));
    this.mark.setAttribute("cy", this.y(up).toFixed(1));
  }
}

class EntryPictures {
  constructor(parent, onPoint) {
    this.corridor = new Plane(parent, "Altitude over speed", onPoint);
    this.track = new Plane(parent, "Ground track", onPoint);
  }

  // Coasts as lines of longitudes and latitudes, deg. The text says how they are written.
  static coasts() {
    EntryPictures.read ??= $("coasts").textContent.trim().split("\n").filter((line) => !line.startsWith("#")).map((line) => {
      const [steps, points] = [line.split(" ").map(Number), []];
      for (let k = 0, x = 0, y = 0; k + 1 < steps.length; k += 2) points.push([(x += steps[k]) / 20, (y += steps[k + 1]) / 20]);
      return points;
    });
    return EntryPictures.read;
  }

  show({ time, of, limits, planet, target }) {
    const zip = (a, b) => Array.from(a, (value, row) => [value, b[row]]);
    const [altitude, speed] = [of("plant.motion.altitude").map((value) => value / 1e3), of("plant.motion.speed").map((value) => value / 1e3)];
    const curves = [
      ...this.limits(of, altitude, limits, planet).map(([name, values], i) => ({
        name, points: zip(speed, values), style: { stroke: `var(--c${i + 1})`, "stroke-width": 1.4, "stroke-dasharray": Chart.DASHES[i + 1] },
      })),
      { name: "flight", points: zip(speed, altitude), style: { stroke: "var(--ink)", "stroke-width": 2.4 } },
    ];
    this.corridor.show({
      labels: ["speed, km/s", "altitude, km"], ranges: [[0, 1.03 * Math.max(...speed)], [0, 1.03 * Math.max(...altitude)]],
      curves, marks: [], time, path: zip(speed, altitude),
    });
    const [east, north, reversals] = [of("plant.motion.longitude").map((x) => x * DEG), of("plant.motion.latitude").map((x) => x * DEG), of("guidance.reversals")];
    const ends = (values, extra) => { const all = [...values, extra]; return [Math.min(...all) - 3, Math.max(...all) + 3]; };
    const flown = zip(east, north);
    const turned = flown.filter((_, row) => row > 0 && reversals[row] > reversals[row - 1]);
    this.track.show({
      labels: ["longitude, deg", "latitude, deg"], ranges: [ends(east, target[0]), ends(north, target[1])], equal: true,
      curves: [
        ...EntryPictures.coasts().flatMap((points) => [-360, 0, 360].map((turn) => ({
          points: points.map(([x, y]) => [x + turn, y]), style: { stroke: "var(--muted)", "stroke-width": 1 },
        }))),
        { name: "flight", points: flown, style: { stroke: "var(--c0)", "stroke-width": 2.4 } },
      ],
      marks: [
        ...turned.map((at, i) => ({ name: i ? "" : "bank reversal", at, style: { r: 4, fill: "var(--c1)" } })),
        { name: "runway point", at: target, style: { r: 6, fill: "none", stroke: "var(--ink)", "stroke-width": 2 } },
      ],
      time, path: flown,
    });
  }

  // Altitudes at which each quantity would be at its limit at the speed of the flight. At constant speed load, pressure
  // and lift are proportional to the density, and the heat flux to its root; the density over altitude is the flight's own.
  limits(of, altitude, limits, { radius, gravitation }) {
    const [density, speed] = [of("plant.flow.density"), of("plant.motion.speed")];
    const order = Array.from(density.keys()).sort((a, b) => density[a] - density[b]);
    const [logs, heights] = [order.map((row) => Math.log(density[row])), order.map((row) => altitude[row])];
    const height = (wanted) => {
      if (!(wanted >= logs[0] && wanted <= logs.at(-1))) return NaN;
      const row = Math.min(rowAt(logs, wanted), logs.length - 2);
      const share = (wanted - logs[row]) / (logs[row + 1] - logs[row] || 1);
      return heights[row] + share * (heights[row + 1] - heights[row]);
    };
    const at = (column, limit, power) => of(column).map((value, row) => height(Math.log(density[row]) + Math.log(limit / value) / power));
    return [
      ["heat flux limit", at("plant.heating.flux", limits.heatFlux, 0.5)],
      ["load limit", at("plant.loadFactor", limits.load, 1)],
      ["pressure limit", at("plant.flight.dynamicPressure", limits.pressure, 1)],
      ["equilibrium glide", of("plant.load.lift").map((lift, row) => {
        const distance = radius + 1e3 * altitude[row];
        const needed = gravitation / distance ** 2 - speed[row] ** 2 / distance;
        return height(Math.log(density[row] * needed / lift));
      })],
    ];
  }

  point(time) {
    this.corridor.point(time);
    this.track.point(time);
  }
}
