// The settings of the page: which parameters it shows, their values, and how they are written into addresses.
//
// Names, units, limits, descriptions and start values are those of the FMUs' variable tables, which the module hands
// out. Here stands only what a slider needs besides: its label and its range.
"use strict";

const DELAY = ["Delay", [
  ["plant.actuation.delay", "actual", 0, 0.2],
  ["controller.delay", "known to the law", 0, 0.2],
]];
const ATTITUDE = [
  ["Disturbance", [
    ["plant.disturbance.kind", "kind"],
    ["plant.disturbance.bound", "bound", 0, 6],
    ["plant.disturbance.seed", "seed"],
  ]],
  ["Start", [
    ["plant.initial.alpha", "attack α", -10, 30],
    ["plant.initial.beta", "sideslip β", -15, 15],
    ["plant.initial.sigma", "bank σ", -60, 20],
  ]],
  DELAY,
  ["Vehicle and limits", [
    ["plant.inertia.scale", "inertia", 0.8, 1.2],
    ["controller.limit.rate", "rate limit", 1, 10],
    ["controller.limit.moment", "moment limit", 40, 300],
    ["controller.saturation", "scale the moment into its limit"],
  ]],
];
// A table of the air of one row: the same at all altitudes.
const AIR = { "plant.air.rows": 1 };
const ENTRY = [
  ["Entry interface, at 120 km", [
    ["plant.initial.speed", "speed", 7200, 7800],
    ["plant.initial.flightPathAngle", "path angle", -2.5, -0.5],
    ["plant.initial.heading", "heading", 40, 80],
  ]],
  ["What guidance and law do not know", [
    ["plant.air.densityRatio[1]", "density", 0.7, 1.3, AIR],
    ["plant.air.wind.north[1]", "wind to the north", -100, 100, AIR],
    ["plant.air.wind.east[1]", "wind to the east", -100, 100, AIR],
    ["plant.aerodynamics.lift.scale", "lift", 0.8, 1.2],
    ["plant.aerodynamics.drag.scale", "drag", 0.8, 1.2],
    ["plant.aerodynamics.moment.scale", "moments of the air", 0.5, 1.5],
    ["plant.inertia.scale", "inertia", 0.8, 1.2],
  ]],
  ["Target", [
    ["guidance.target.longitude", "longitude", 60, 95],
    ["guidance.target.latitude", "latitude", 15, 40],
  ]],
  ["Limits of the guidance", [
    ["guidance.limit.heatFlux", "heat flux", 440, 900],
    ["guidance.limit.load", "load", 1.2, 4],
    ["guidance.limit.pressure", "dynamic pressure", 13, 30],
  ]],
  DELAY,
  ["Limits of the law", [
    ["controller.limit.rate", "rate limit", 1, 10],
    ["controller.limit.moment", "moment limit", 40, 300],
    ["controller.saturation", "scale the moment into its limit"],
  ]],
];
// Tuned parameters of a law; the rest is folded away.
const GAINS = /^(weight|feedback|terminal|gain|surface|reaching|boundaryLayer|slidingMode|inner|outer|observer|commandFilter)\.|^disturbance\.bound$/;
const HIDDEN = /^(period|trajectory|solver\.timeBudget)|^(reference|settings)\.file$/;
// Units that read better: factor and name.
const READABLE = { "N.m": [1e-3, "kN m"], "W/m2": [1e-3, "kW/m²"], Pa: [1e-3, "kPa"] };

const rounded = (value) => Number(value.toPrecision(12));

// A parameter with everything that is known of it, by the name `component.name`.
class Parameter {
  constructor(component, variable, given) {
    this.name = `${component}.${variable.name}`;
    this.variable = variable;
    [[this.type, this.kind]] = Object.entries(variable.kind);
    this.display = this.kind.unit?.display ?? null;
    // Value unless it is changed: that of the scenario or the start value.
    this.initial = given ?? this.startValue();
  }

  startValue() {
    if (this.type === "Enumeration") return this.kind.of.items[this.kind.start - 1][0];
    return this.kind.start;
  }

  // Number to show, in the display unit. Not a number: a text in a unit that is not the variable's, which is refused.
  shown(value) {
    if (typeof value === "string") {
      const [, number, unit] = /^\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(.*)$/i.exec(value) ?? [];
      if (unit === this.display?.name) return Number(number);
      if (unit !== this.kind.unit?.name) return NaN;
      value = Number(number);
    }
    const [factor] = READABLE[this.kind.unit?.name] ?? [1];
    return rounded(value * (this.display?.factor ?? factor));
  }

  // Value of a number that is shown, as experiment files write it.
  written(number) {
    if (this.type !== "Real") return number;
    if (this.display) return `${rounded(number)} ${this.display.name}`;
    return rounded(number / (READABLE[this.kind.unit?.name]?.[0] ?? 1));
  }

  isInitial(value) {
    return value === this.initial || (this.type === "Real" && this.shown(value) === this.shown(this.initial));
  }

  get unit() {
    const name = this.display?.name ?? READABLE[this.kind.unit?.name]?.[1] ?? this.kind.unit?.name ?? "";
    return name.replace(/(?<=[a-z])([0-9])$/, (digit) => "²³"[digit - 2]).replace(".", " ");
  }

  // Range of a slider around the initial value, within the limits of the variable.
  range() {
    const initial = this.shown(this.initial);
    const size = Math.abs(initial) * 3 || this.shown(this.kind.nominal ?? 1);
    let [low, high] = initial < 0 ? [-size, 0] : [0, size];
    const step = Chart.step(size, 200);
    if (this.kind.min !== null) low = Math.max(low, this.shown(this.kind.min));
    if (this.kind.max !== null) high = Math.min(high, this.shown(this.kind.max));
    // Laws refuse many limits themselves, such as a gain of 0.
    if (low === this.shown(this.kind.min ?? NaN) && low < initial) low += step;
    if (high === this.shown(this.kind.max ?? NaN) && high > initial) high -= step;
    return [rounded(low), rounded(high)];
  }
}

class Settings {
  constructor(description) {
    this.description = description;
    this.controllers = new Map(description.controllers.map((choice) => [choice.id, choice]));
    this.set = {};
    this.own = new OwnLaw();
    this.flight = "attitude";
    this.choose(description.controllers[0].id);
    const names = (choice) => new Set(this.table(choice.fmu).map(({ name }) => name));
    const all = description.controllers.map(names);
    this.common = new Set([...all[0]].filter((name) => all.every((each) => each.has(name))));
  }

  table(fmu) {
    return this.description.fmus[fmu].parameters.filter(({ kind }) => !kind.String);
  }

  // The flight as it is described: columns, components, and its length.
  get scenario() {
    return this.description.scenarios[this.flight];
  }

  get isEntry() {
    return this.flight === "entry";
  }

  // Chooses a flight, with all settings as they are in it.
  fly(id) {
    if (!(id in this.description.scenarios)) throw new Error(`there is no flight "${id}"`);
    this.flight = id;
    this.set = {};
    this.choose(this.choice.id);
  }

  // Chooses a controller. Settings stay if it has such parameters and they mean the same.
  choose(id) {
    if (!this.controllers.has(id)) throw new Error(`there is no controller "${id}"`);
    this.choice = this.controllers.get(id);
    const { components } = this.scenario;
    this.parameters = new Map();
    const add = (component, fmu, given) => {
      for (const variable of this.table(fmu)) {
        const parameter = new Parameter(component, variable, given[variable.name]);
        this.parameters.set(parameter.name, parameter);
      }
    };
    for (const [name, { fmu, parameters }] of Object.entries(components)) {
      if (name !== "controller") add(name, fmu, parameters);
    }
    add("controller", this.choice.fmu, { ...components.controller.parameters, ...this.choice.set });
    for (const name of Object.keys(this.set)) {
      const [component, ...rest] = name.split(".");
      if (component === "controller" && !this.common.has(rest.join("."))) delete this.set[name];
    }
  }

  value(name) {
    return this.set[name] ?? this.parameters.get(name).initial;
  }

  change(name, value) {
    if (this.parameters.get(name).isInitial(value)) delete this.set[name];
    else this.set[name] = value;
  }

  request() {
    return { scenario: this.flight, controller: this.choice.id, set: { ...this.set } };
  }

  // The flight that is asked for, which stays the same whatever is changed meanwhile. `number` is a parameter's value in
  // SI units.
  asked() {
    const { choice, isEntry, parameters, scenario } = this;
    const request = this.request();
    const number = (name) => {
      const parameter = parameters.get(name);
      return parameter.shown(request.set[name] ?? parameter.initial) / parameter.shown(1);
    };
    const code = choice.id === OWN ? this.own.code : null;
    return { request, code, name: choice.name.replace(", ", " with "), isEntry, number, scenario };
  }

  address() {
    const law = this.choice.id === OWN && this.own.code !== EXAMPLE ? { law: this.own.code } : {};
    const flight = this.isEntry ? { flight: this.flight } : {};
    return new URLSearchParams({ ...flight, controller: this.choice.id, ...this.set, ...law }).toString();
  }

  // Takes the settings of an address. Returns the names that it does not know.
  read(address) {
    const given = new URLSearchParams(address);
    this.fly(given.get("flight") ?? "attitude");
    this.choose(given.get("controller") ?? this.description.controllers[0].id);
    this.own.code = given.get("law") ?? (this.choice.id === OWN ? EXAMPLE : this.own.code);
    const unknown = [];
    for (const [name, text] of given) {
      const parameter = this.parameters.get(name);
      if (["flight", "controller", "law"].includes(name)) continue;
      if (!parameter) unknown.push(name);
      else if (/^(true|false)$/.test(text)) this.change(name, text === "true");
      else this.change(name, text.trim() !== "" && !Number.isNaN(Number(text)) ? Number(text) : text);
    }
    return unknown;
  }

  // The groups of rows: [title, rows, folded], a row being { names, label, low, high }.
  groups() {
    const taken = new Set();
    const shown = (this.isEntry ? ENTRY : ATTITUDE).map(([title, rows]) => [title, rows.filter(([name]) => this.parameters.has(name))]);
    const groups = shown.map(([title, rows]) => [title, rows.map(([name, label, low, high, needs]) => {
      taken.add(name);
      return { names: [name], label, low, high, needs };
    })]);
    const own = [...this.parameters.values()].filter(({ name }) => name.startsWith("controller."));
    const open = own.filter(({ name, variable }) => !taken.has(name) && !HIDDEN.test(variable.name));
    const gains = open.filter(({ variable, type }) =>
      type === "Real" && !this.common.has(variable.name) && GAINS.test(variable.name));
    groups.push([`Gains of ${this.choice.name}`, Settings.joined(gains)]);
    const further = open.filter((parameter) => !gains.includes(parameter));
    const more = this.isEntry
      ? /^plant\.(inertia|initial|disturbance\.(?!table)|aerodynamics|end)/
      : /^plant\.(inertia|initial\.[pqr]$|disturbance\.(?!table)|kinematics|integrator)/;
    const rest = (which) => [...this.parameters.values()].filter(({ name }) => which.test(name) && !taken.has(name));
    const alone = ({ name, variable }) => ({ names: [name], label: variable.name, exact: true });
    groups.push([`Further parameters of ${this.choice.name}`, further.map(alone), true]);
    groups.push(["Further parameters of the vehicle", rest(more).map(alone), true]);
    groups.push(["Further parameters of the guidance", rest(/^guidance\.(?!planet)/).map(alone), true]);
    return groups.filter(([, rows]) => rows.length);
  }

  // Components of a vector that begin equal have one slider, which sets all of them.
  static joined(parameters) {
    const vectors = new Map();
    for (const parameter of parameters) {
      const base = parameter.variable.name.replace(/\[\d+\]$/, "");
      vectors.set(base, [...(vectors.get(base) ?? []), parameter]);
    }
    return [...vectors].flatMap(([base, parts]) => {
      const equal = parts.every(({ initial }) => initial === parts[0].initial);
      const rows = equal ? [parts] : parts.map((part) => [part]);
      return rows.map((row) => {
        const [low, high] = row[0].range();
        const label = row.length > 1 ? `${base}, all` : row[0].variable.name;
        return { names: row.map(({ name }) => name), label, low, high };
      });
    });
  }
}
