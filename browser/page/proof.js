// The section "See the guarantee": the picture, what it says at the chosen time, and the three disturbances to look at.
"use strict";

// Disturbances: name, meaning, and settings that differ from the scenario.
const DISTURBANCES = [
  ["The paper's noise", "drawn anew at every tick, in each axis", {}],
  ["A hostile one", "always pushes the way the vehicle turns", { "plant.disturbance.kind": "alongRate" }],
  ["More than was assumed", "one and a half times what the law counts on",
    { "plant.disturbance.kind": "alongRate", "plant.disturbance.bound": "3 deg/s2" }],
];
const ACTING = "plant.disturbance.bound";
const ASSUMED = "controller.disturbance.bound";
const POLICY = "controller.guarantee.policy";
const QUANTITIES = 5;

class Proof {
  constructor() {
    this.picture = new GuaranteePicture($("plan"), point);
    this.buttons = DISTURBANCES.map(([name, meaning], index) => {
      const button = document.createElement("button");
      button.type = "button";
      button.innerHTML = `${name}<small>${meaning}</small>`;
      button.onclick = () => { this.choose(index); point(0); };
      return button;
    });
    $("disturbances").replaceChildren(...this.buttons);
    $("assumed").oninput = () => this.assume($("assumed").valueAsNumber);
  }

  // Settings of one of the three disturbances; what is assumed stays unless it is the paper's again.
  choose(index) {
    for (const name of ["plant.disturbance.kind", ACTING, ASSUMED, POLICY]) delete settings.set[name];
    for (const [name, value] of Object.entries(DISTURBANCES[index][2])) settings.change(name, value);
    build();
    changed([], null);
  }

  // Index of the disturbance that is set; −1 for another one.
  chosen() {
    const kind = settings.value("plant.disturbance.kind");
    const [acting, assumed] = this.bounds();
    if (kind === "white") return acting === assumed ? 0 : -1;
    return kind === "alongRate" ? (acting > assumed ? 2 : 1) : -1;
  }

  // Bounds of the disturbance that acts and of the one that is assumed, deg/s².
  bounds() {
    return [ACTING, ASSUMED].map((name) => settings.parameters.get(name).shown(settings.value(name)));
  }

  // Where no guarantee can be given for a bound, the flight goes on without one, so that it can be seen to end.
  assume(bound) {
    const names = this.chosen() === 2 ? [ACTING] : [ACTING, ASSUMED];
    settings.change(POLICY, "bestEffort");
    changed(names, `${bound} deg/s2`);
    build();
  }

  show() {
    const { plans, time: at, rates, moment, summary, ghost } = flight;
    $("proof").hidden = plans.length === 0;
    if (!plans.length) return;
    const norms = [norm(rates), norm(moment)];
    const limits = [summary.limits.rate * DEG, summary.limits.moment * 1e-3];
    const holds = (row) => LIGHTS[standing(row)[0]] === "good";
    const shown = { stop, time: at, norms, limits, plans, holds, ghost };
    this.picture.show(shown, Math.min(time, at.at(-1)));
    const chosen = this.chosen();
    this.buttons.forEach((button, index) => button.setAttribute("aria-pressed", index === chosen));
    const [acting, assumed] = [ACTING, ASSUMED].map((name) => flight.number(name) * DEG);
    $("assumed").value = chosen === 2 ? acting : assumed;
    $("bound-of").textContent = chosen === 2 ? "Disturbance that acts" : "Disturbance, acting and assumed";
    $("bound-value").textContent = `${(chosen === 2 ? acting : assumed).toFixed(2)} deg/s²`;
    const percent = (ratio) => `${(100 * ratio).toFixed(0)} %`;
    const used = ({ rate_ratio, moment_ratio }) => `${percent(rate_ratio)} of the rate limit and ${percent(moment_ratio)} of the moment limit`;
    $("versus").textContent = `${flight.name.split(" with ")[0]} takes ${used(summary)}${ghost ? `; ${ghost.name}, under the same disturbance, ${used(ghost.summary)}` : ""}.`;
    this.assumed = assumed;
    this.limits = limits;
    this.point(time);
  }

  point(at) {
    if (!flight?.plans.length) return;
    const shown = Math.min(at, flight.time.at(-1));
    this.picture.point(shown);
    const [status, why] = standing(this.picture.row(shown));
    const [rate, moment] = this.limits;
    const holds = LIGHTS[status] === "good";
    $("lamp").className = LIGHTS[status] ?? "none";
    $("lamp-says").textContent = holds ? "Guaranteed" : "Not guaranteed";
    $("lamp-means").textContent = holds
      ? `for every disturbance up to ${this.assumed.toFixed(2)} deg/s² in each axis, not only for this one`
      : "the law flies on, but nothing is proven of what it does here";
    $("promise").textContent = holds
      ? `Whatever the disturbance does within its bound, the vehicle keeps to ${rate.toFixed(1)} deg/s and ${moment.toFixed(0)} kN m.`
      : `Guarantee ${why ?? "not given"}.`;
  }
}

// The plans of a flight, from the module's numbers: the beginning, then times, rates, their bounds, moments, theirs.
function readPlans(values) {
  const plans = [];
  const count = 25;
  for (let from = 0; from < values.length; from += 1 + QUANTITIES * count) {
    const part = (index, factor) => Array.from(values.subarray(from + 1 + index * count, from + 1 + (index + 1) * count), (value) => value * factor);
    plans.push({ began: values[from], at: part(0, 1), norms: [part(1, DEG), part(3, 1e-3)], bounds: [part(2, DEG), part(4, 1e-3)] });
  }
  return plans;
}
