// A view of a vehicle's attitude, drawn on a canvas without any library.
//
//   const view = new Vehicle3D(canvas);
//   view.show({
//     angles: [alpha, beta, sigma],          // rad: angle of attack, sideslip, bank
//     reference: [alpha, beta, sigma],       // rad, of the ghost; left out: no ghost
//     flaps: [left, right],                  // rad, positive downwards; left out: not deflected
//     light: { state: "good", text: "guarantee in force" },   // good, warn, bad or none
//   });
//   view.draw();                             // again, after a change of size or theme
//
// The velocity points along the grid. Body axes: x forward, y to the right, z down. Dragging and the
// arrow keys turn the camera, a double click and Home turn it back. Colours are CSS variables of the
// canvas: --ink, --muted, --line, --x, --y, --z, --velocity, --good, --warn, --bad, --hull, --belly;
// what is not defined has a default. The canvas gives the size; its width and height are set here.
"use strict";

class Vehicle3D {
  static FRONT = { yaw: -0.72, pitch: 0.36 };
  // Shape of the hull by stations along x: half width, height above and depth below the axis, m.
  static STATIONS = [
    [7.2, 0.05, 0.05, 0.05], [6.6, 0.55, 0.42, 0.38], [5.2, 1.05, 0.8, 0.62], [2.5, 1.65, 1.2, 0.78],
    [-1.0, 2.35, 1.42, 0.82], [-4.0, 2.95, 1.4, 0.8], [-5.6, 3.1, 1.2, 0.75],
  ];
  static RING = 14;

  constructor(canvas) {
    this.canvas = canvas;
    this.camera = { ...Vehicle3D.FRONT };
    this.state = { angles: [0, 0, 0], light: { state: "none", text: "" } };
    this.hull = Vehicle3D.mesh();
    canvas.tabIndex = 0;
    canvas.style.touchAction = "pan-y";
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  show(state) {
    this.state = state;
    this.draw();
  }

  listen() {
    const { canvas, camera } = this;
    const turn = (yaw, pitch) => {
      camera.yaw += yaw;
      camera.pitch = Math.max(-1.5, Math.min(1.5, camera.pitch + pitch));
      this.draw();
    };
    const back = () => { Object.assign(camera, Vehicle3D.FRONT); this.draw(); };
    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
      last = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      turn((event.clientX - last[0]) * 0.01, (event.clientY - last[1]) * 0.01);
      last = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { last = null; });
    canvas.addEventListener("dblclick", back);
    const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "Home") back();
      else if (keys[event.key]) turn(...keys[event.key]);
      else return;
      event.preventDefault();
    });
  }

  // Faces of the vehicle in body axes: points in order, part of the vehicle, and whether only the
  // outside can be seen.
  static mesh() {
    const faces = [];
    const ring = ([x, width, above, below]) => Array.from({ length: Vehicle3D.RING }, (_, i) => {
      const turn = (2 * Math.PI * i) / Vehicle3D.RING;
      // The belly is flat, the back is round.
      const side = Math.sin(turn), up = Math.cos(turn);
      const lift = up > 0 ? above * up : -below * Math.pow(-up, 0.55);
      return [x, width * side * (up < 0 ? Math.pow(Math.max(1e-3, 1 - up * up), -0.12) : 1), -lift];
    });
    const rings = Vehicle3D.STATIONS.map(ring);
    for (let s = 0; s + 1 < rings.length; s++) {
      for (let i = 0; i < Vehicle3D.RING; i++) {
        const j = (i + 1) % Vehicle3D.RING;
        const points = [rings[s][i], rings[s][j], rings[s + 1][j], rings[s + 1][i]];
        const low = points.reduce((sum, p) => sum + p[2], 0) > 0.3;
        faces.push({ points, part: low ? "belly" : "hull", closed: true });
      }
    }
    faces.push({ points: rings.at(-1), part: "belly", closed: true });
    for (const side of [-1, 1]) {
      const fin = [[-2.6, 2.5, -0.4], [-5.0, 4.0, -2.9], [-6.1, 4.05, -2.95], [-5.6, 2.95, -0.3]];
      faces.push({ points: fin.map(([x, y, z]) => [x, side * y, z]), part: "hull", closed: false });
      const flap = [[-5.6, 0.35, 0.7], [-5.6, 2.5, 0.7], [-7.1, 2.4, 0.7], [-7.1, 0.45, 0.7]];
      faces.push({ points: flap.map(([x, y, z]) => [x, side * y, z]), part: "belly", closed: false, flap: side });
    }
    const canopy = [[5.0, 0.5, -0.74], [5.0, -0.5, -0.74], [3.6, -0.62, -1.1], [3.6, 0.62, -1.1]];
    faces.push({ points: canopy.map(([x, y, z]) => [x, y, z - 0.03]), part: "glass", closed: false, above: true });
    return faces;
  }

  // Body axes to axes with x along the velocity and z down, as columns of rows. A positive bank angle raises the right
  // wing, as in the papers: σ̇ = −p cos α − r sin α without sideslip.
  static rotation([alpha, beta, sigma]) {
    const [ca, sa, cb, sb, cs, ss] = [alpha, beta, sigma].flatMap((a) => [Math.cos(a), Math.sin(a)]);
    const first = [[cb * ca, sb, cb * sa], [-sb * ca, cb, -sb * sa], [-sa, 0, ca]];
    const [x, y, z] = first;
    const row = (a, b) => y.map((value, i) => a * value + b * z[i]);
    return [x, row(cs, ss), row(-ss, cs)];
  }

  static times(matrix, v) {
    return matrix.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
  }

  draw() {
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const context = (this.context = canvas.getContext("2d"));
    context.scale(ratio, ratio);
    context.lineJoin = context.lineCap = "round";
    const style = getComputedStyle(canvas);
    const defaults = {
      ink: "#1b1d20", muted: "#63686f", line: "#dddfdd", x: "#0072b2", y: "#d55e00", z: "#009e73",
      velocity: "#1b1d20", good: "#009e73", warn: "#e69f00", bad: "#d55e00", hull: "#e4e7ea", belly: "#565c65",
    };
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim() || defaults[name];
    context.font = `12px ${style.fontFamily || "sans-serif"}`;
    this.size = { width, height, scale: Math.min(width / 18.5, height / 14.5), middle: [width * 0.53, height / 2 + 14] };
    this.ground();
    this.vehicle();
    this.words();
  }

  // Place on the canvas of a point in the axes of the velocity, with its depth.
  project(v) {
    const { yaw, pitch } = this.camera;
    const { scale, middle } = this.size;
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    const right = -sy * v[0] + cy * v[1];
    const ahead = cy * v[0] + sy * v[1];
    const up = -v[2] * cp + ahead * sp;
    const depth = ahead * cp + v[2] * sp;
    const near = 40 / (40 + depth);
    return [middle[0] + right * scale * near, middle[1] - up * scale * near, depth];
  }

  line(points, colour, width, dash = []) {
    const { context } = this;
    context.beginPath();
    points.forEach((v, i) => context[i ? "lineTo" : "moveTo"](...this.project(v).slice(0, 2)));
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  ground() {
    const colour = this.colour("line");
    for (let i = -8; i <= 8; i += 2) {
      const reach = Math.sqrt(Math.max(0, 81 - i * i));
      this.line([[-reach, i, 4.6], [reach, i, 4.6]], colour, 0.8);
      this.line([[i, -reach, 4.6], [i, reach, 4.6]], colour, 0.8);
    }
  }

  arrow(from, to, colour, label, width = 2) {
    const { context } = this;
    this.line([from, to], colour, width);
    const [a, b] = [this.project(from), this.project(to)];
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    const [dx, dy] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    const head = Math.min(7, length / 2);
    context.beginPath();
    context.moveTo(b[0] + dx * head, b[1] + dy * head);
    context.lineTo(b[0] - dy * head * 0.5, b[1] + dx * head * 0.5);
    context.lineTo(b[0] + dy * head * 0.5, b[1] - dx * head * 0.5);
    context.fillStyle = colour;
    context.fill();
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(label, b[0] + dx * 17, b[1] + dy * 17);
  }

  placed(face) {
    const angle = face.flap ? ((this.state.flaps || [])[face.flap < 0 ? 0 : 1] || 0) : 0;
    if (!angle) return face.points;
    const hinge = face.points[0];
    return face.points.map(([x, y, z]) => {
      const arm = hinge[0] - x;
      return [hinge[0] - arm * Math.cos(angle), y, z + arm * Math.sin(angle)];
    });
  }

  vehicle() {
    const { context, state } = this;
    const turned = Vehicle3D.rotation(state.angles);
    const at = (v) => Vehicle3D.times(turned, v);
    this.arrow([0, 0, 0], [10.2, 0, 0], this.colour("velocity"), "v", 1.6);
    this.arrow([0, 0, 0], at([0, 0, 4.2]), this.colour("z"), "z");
    const faces = this.hull.map((face) => {
      const points = this.placed(face).map(at);
      const seen = points.map((v) => this.project(v));
      const depth = seen.reduce((sum, p) => sum + p[2], 0) / seen.length;
      return { face, points, seen, depth: depth - (face.above ? 1 : 0) };
    });
    for (const { face, points, seen } of faces.sort((a, b) => b.depth - a.depth)) {
      let area = 0;
      seen.forEach((p, i) => { const q = seen[(i + 1) % seen.length]; area += p[0] * q[1] - q[0] * p[1]; });
      if ((face.closed || face.above) && area < 0) continue;
      context.beginPath();
      seen.forEach((p, i) => context[i ? "lineTo" : "moveTo"](p[0], p[1]));
      context.closePath();
      context.fillStyle = context.strokeStyle = this.shade(face.part, points);
      context.lineWidth = 0.7;
      context.fill();
      context.stroke();
    }
    if (state.reference) this.ghost(state.reference);
    this.arrow(at([7.2, 0, 0]), at([9.6, 0, 0]), this.colour("x"), "x");
    this.arrow(at([-1, 2.35, 0]), at([-1, 5.4, 0]), this.colour("y"), "y");
  }

  // Outline of the vehicle at the reference: keel, back, edges and stern.
  ghost(angles) {
    const turned = Vehicle3D.rotation(angles);
    const colour = this.colour("ink");
    const trace = (points) => this.line(points.map((v) => Vehicle3D.times(turned, v)), colour, 1.1, [5, 4]);
    const stations = Vehicle3D.STATIONS;
    trace(stations.map(([x, , above]) => [x, 0, -above]));
    for (const side of [-1, 1]) trace(stations.map(([x, width]) => [x, side * width, 0]));
    const [x, width, above] = stations.at(-1);
    const turns = Array.from({ length: 17 }, (_, i) => (Math.PI * (i - 8)) / 16);
    trace(turns.map((turn) => [x, width * Math.sin(turn), -above * Math.cos(turn)]));
    trace([[x, -width, 0], [x, width, 0]]);
  }

  shade(part, points) {
    const [a, b, c] = points;
    const [u, v] = [b.map((value, i) => value - a[i]), c.map((value, i) => value - a[i])];
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const length = Math.hypot(...normal) || 1;
    const light = Math.abs(normal[0] * 0.25 + normal[1] * -0.3 + normal[2] * -0.92) / length;
    const base = part === "glass" ? "#2f3a46" : this.colour(part);
    const amount = 0.66 + 0.34 * light;
    const parts = [1, 3, 5].map((i) => Math.round(parseInt(base.slice(i, i + 2), 16) * amount));
    return `rgb(${parts.join(" ")})`;
  }

  words() {
    const { context, state, size } = this;
    const { light } = state;
    if (light && light.text) {
      const colour = this.colour({ good: "good", warn: "warn", bad: "bad" }[light.state] || "muted");
      context.beginPath();
      context.arc(16, 17, 6, 0, 2 * Math.PI);
      context.strokeStyle = context.fillStyle = colour;
      context.lineWidth = 2;
      context.stroke();
      if (light.state !== "none") context.fill();
      context.fillStyle = this.colour("ink");
      context.textAlign = "left";
      context.textBaseline = "middle";
      context.fillText(light.text, 30, 17.5);
    }
    if (state.reference) {
      context.fillStyle = this.colour("muted");
      context.textAlign = "right";
      context.textBaseline = "middle";
      context.fillText("dashed: reference", size.width - 12, 17.5);
    }
  }
}
