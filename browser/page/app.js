// The page: settings on one side, the flight that they give on the other.
//
// For tests and for curious people: `flight` is the flight that is shown, with its columns and signals, and `first`
// says how long the first one took.
"use strict";

const $ = (id) => document.getElementById(id);
const DEG = 180 / Math.PI;
// Panels: heading, unit, name of the norm that has a limit, and names of the curves.
const PANELS = {
  loads: ["Loads over their limits", "", null, ["heat flux", "load", "dynamic pressure"]],
  attitude: ["Attitude", "deg", null, ["α", "β", "σ"]],
  error: ["Tracking error", "deg", null, ["α", "β", "σ"]],
  rate: ["Body rates", "deg/s", "‖ω‖", ["p", "q", "r"]],
  moment: ["Control moment", "kN m", "‖m‖", ["x", "y", "z"]],
};
// Contradictions of the guarantee's assumptions, by the item of guarantee.contradiction.
const VOID = {
  step: "measurements are older than assumed", delay: "the delay is another than assumed",
  disturbance: "the disturbance is larger than assumed", deviation: "the vehicle is further from its plan than assumed",
  limit: "the law needs more than a limit allows",
};
// Why a guarantee is not in force, by the item of its status.
const MEANING = {
  none: "not given: these constraint sets give none", refused: "refused: not possible with these settings",
  uncertified: "not in force: no plan satisfies its conditions",
};
// Items of the guarantee's status by what they mean for whoever looks.
const LIGHTS = { inForce: "good", pending: "good", exceeded: "bad", uncertified: "warn", stale: "warn", refused: "warn" };
// Columns of the loads, and the parameters with their limits.
const LOADS = [
  ["plant.heating.flux", "heatFlux"], ["plant.loadFactor", "load"], ["plant.flight.dynamicPressure", "pressure"],
];
// Ratio up to which a limit counts as met: 1 up to rounding.
const MET = 1 + 1e-9;

const packed = Uint8Array.from(atob($("module").textContent.trim()), (letter) => letter.charCodeAt(0));
const unpacked = new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
const compiled = unpacked.then(WebAssembly.compile);
// Who flies what is shown, and what it is compared with.
const pilot = new Pilot(compiled), rival = new Pilot(compiled);

let settings, busy = false;
let flight = null;
// What is asked for and not yet flown, what is being flown, and what is to be said of an address once it is.
let wanted = null, sent = null, remark = null;
// When the first flight was drawn, ms after the page was opened.
let first = null;
let time = 26;
// End of the shown flight, s.
let stop = 50;
const view = new Vehicle3D($("view"));
const zoom = (window) => { for (const chart of Object.values(charts)) chart.zoom(window); };
const charts = Object.fromEntries(Object.keys(PANELS).map((id) => [id, new Chart($("charts"), { onPoint: point, onZoom: zoom })]));
let proof = null;
const player = new Player((at) => point(at));
const entry = new EntryPictures($("entry"), (at) => point(at));
// The flight of another law under the same disturbance: { text, shown }, with what was asked for as a text.
let ghost = null;

// --- The flight -----------------------------------------------------------------------------------------------------

function fly() {
  if (settings.choice.id === OWN && !settings.own.isAgreed) {
    say("This address brings a law, which is a program. Read it before you fly it.");
    $("verdict").textContent = "Not flown yet: the law came with the address";
    return;
  }
  wanted = settings.asked();
  if (!busy) send();
  // A law that has been mended does not wait for the text that it replaces.
  else if (sent.code !== null && wanted.code !== sent.code) pilot.dismiss();
}

async function send() {
  while (wanted) {
    [sent, wanted, busy] = [wanted, null, true];
    const patience = setTimeout(() => { $("cost").textContent = "Computing …"; }, 400);
    const answer = await pilot.ask("fly", sent.request, sent.code);
    clearTimeout(patience);
    busy = false;
    if (answer && isStillAsked(sent)) received(answer, sent);
    if (!wanted) remark = null;
  }
}

// Whether no other flight, law or text has been chosen meanwhile. Other values are: a slider is still being dragged.
function isStillAsked({ request, code }) {
  const isText = code === null || code === settings.own.code;
  return request.scenario === settings.flight && request.controller === settings.choice.id && isText;
}

function received(answer, asked) {
  // The shown flight is not that of the settings.
  document.body.classList.toggle("refused", Boolean(answer.error));
  if (answer.error) return refused(answer);
  if (asked.code !== null) settings.own.say("");
  flight = read(answer, asked);
  compare();
  say(remark?.text ?? "", remark?.wrong);
  show();
  first ??= performance.now();
  document.documentElement.dataset.flights = 1 + Number(document.documentElement.dataset.flights ?? 0);
}

async function refused({ error, line, isSyntax }) {
  const own = settings.choice.id === OWN && error.startsWith("your law");
  if (own && isSyntax) {
    line = await OwnLaw.line(settings.own.code);
    if (line) error = error.replace("your law", `your law, line ${line}`);
  }
  if (own) settings.own.say(error, line);
  say(own ? "" : error, true);
  $("verdict").textContent = `Refused: ${error}`;
}

// A flight: what was asked for, and the columns of what was flown.
function read({ text, signals, plans, ms }, asked) {
  const summary = JSON.parse(text);
  const { columns } = asked.scenario;
  const width = columns.length;
  const rows = signals.length / width;
  const column = (index, factor) => Float64Array.from({ length: rows }, (_, row) => signals[row * width + index] * factor);
  const three = (first, factor) => [0, 1, 2].map((i) => column(first + i, factor));
  const angles = three(1, DEG), reference = three(7, DEG);
  const errors = angles.map((angle, i) => angle.map((value, row) => value - reference[i][row]));
  return {
    ...asked, ghost: null, summary, signals, columns, ms, rows, width, time: column(0, 1), angles, reference, errors, plans: readPlans(plans),
    rates: three(4, DEG), moment: three(10, 1e-3), status: column(width - 2, 1), contradiction: column(width - 1, 1),
    of: (name) => column(columns.indexOf(name), 1),
  };
}

// Asks for the flight to compare with: that of another law with the settings that all laws share.
async function compare() {
  const id = $("ghost").value, choice = settings.controllers.get(id);
  const { scenario, request: { controller, scenario: name, set } } = flight;
  const shared = Object.entries(set).filter(([name]) => !name.startsWith("controller.") || settings.common.has(name.replace("controller.", "")));
  const code = id === OWN ? settings.own.code : null;
  const request = { scenario: name, controller: id, set: Object.fromEntries(shared) };
  const text = JSON.stringify([request, code]);
  if (!choice || id === controller || (code !== null && !settings.own.isAgreed)) ghost = null;
  // A flight of another disturbance is not shown beside this one.
  else if (text !== ghost?.text) {
    const mine = ghost = { text, shown: null };
    const answer = await rival.ask("fly", request, code);
    if (ghost !== mine || !flight || !answer || answer.error) return;
    const other = read(answer, { scenario, name: choice.name.split(",")[0] });
    mine.shown = { ...other, norms: [norm(other.rates), norm(other.moment)] };
    flight.ghost = mine.shown;
    return show();
  }
  flight.ghost = ghost?.shown ?? null;
}

function norm([x, y, z]) {
  return x.map((_, row) => Math.hypot(x[row], y[row], z[row]));
}

// The curves of a panel, of the flight and of the one that it is compared with, which lies below.
function panel(id, limits) {
  const [label, unit, bold, names] = PANELS[id];
  if (id === "loads") {
    const curves = LOADS.map(([column, limit], place) => {
      const most = flight.number(`guidance.limit.${limit}`);
      return { name: names[place], role: "signal", run: 0, place, values: flight.of(column).map((value) => value / most) };
    });
    return { label, unit, curves, limits: [{ name: "limit", value: 1 }] };
  }
  const of = (each, run) => {
    const values = { attitude: each.angles, error: each.errors, rate: each.rates, moment: each.moment }[id];
    const all = values.map((curve, place) => ({ name: names[place], role: "signal", run, place, values: curve }));
    if (bold) all.unshift({ name: bold, role: "norm", run, place: 0, values: norm(values) });
    return all;
  };
  const { reference, ghost: other } = flight;
  const curves = [...of(flight, 0), ...(other ? of(other, 1) : [])];
  if (id === "attitude") curves.push(...reference.map((values, place) => ({ name: "reference", role: "reference", run: 0, place, values })));
  const shown = { label, unit, curves, limits: bold ? [{ name: `limit of ${bold}`, value: limits[id] }] : [] };
  const most = bold && curves[0].values.reduce((a, b) => Math.max(a, b), 0);
  // A limit that is exceeded five times could not be told from zero.
  return most > 5 * limits[id] ? { ...shown, label: `${label}, magnitude`, magnitudes: [limits[id] / 20, 1.3 * most] } : shown;
}

function show() {
  const { summary, ghost: other } = flight;
  const limits = { rate: summary.limits.rate * DEG, moment: summary.limits.moment * 1e-3 };
  const runs = [{ time: flight.time }, ...(other ? [{ time: other.time, faint: true }] : [])];
  stop = flight.isEntry ? flight.time.at(-1) : flight.scenario.stop;
  player.range(0, flight.time.at(-1) ?? stop);
  charts.loads.figure.hidden = $("entry").hidden = !flight.isEntry;
  for (const id of Object.keys(PANELS)) if (!charts[id].figure.hidden) charts[id].show(panel(id, limits), runs, [0, stop]);
  if (flight.isEntry) {
    const of = (name) => flight.number(`guidance.${name}`);
    const allowed = Object.fromEntries(LOADS.map(([, name]) => [name, of(`limit.${name}`)]));
    entry.show({ time: flight.time, of: flight.of, limits: allowed, planet: { radius: of("planet.radius"), gravitation: of("planet.gravitation") }, target: [of("target.longitude") * DEG, of("target.latitude") * DEG] });
  }
  $("ghost-says").textContent = other ? ` Dashed: ${other.name} under the same disturbance.` : "";
  $("faint-says").textContent = other ? ` Pale: ${other.name} under the same disturbance.` : "";
  proof.show();
  judge(limits);
  player.show(time);
  pose(time);
  $("cost").textContent = `Computed in ${flight.ms.toFixed(0)} ms.`;
}

// --- The verdict ----------------------------------------------------------------------------------------------------

// Item of the guarantee's status at a row, and why the guarantee is not in force there; nothing if there is none or it is.
function standing(row) {
  const [statuses, contradictions] = flight.summary.guarantee;
  const status = statuses[flight.status[row] - 1]?.[0];
  if (status === undefined || LIGHTS[status] === "good") return [status, null];
  const why = VOID[contradictions[flight.contradiction[row] - 1]?.[0]];
  return [status, MEANING[status] ?? `void: ${why ?? "an assumption is contradicted"}`];
}

function guarantee() {
  if (!flight.summary.guarantee[0].length) return ["none", `${flight.name} gives none`];
  const rows = Math.max(1, flight.rows - 1);
  // Rows by why the guarantee is not in force, each with the light of the status.
  const reasons = new Map();
  let good = 0;
  for (let row = 0; row < rows; row++) {
    const [status, why] = standing(row);
    if (!why) good++;
    else reasons.set(why, { light: LIGHTS[status] ?? "none", rows: (reasons.get(why)?.rows ?? 0) + 1 });
  }
  if (good === rows) return ["good", "in force throughout"];
  const [[why, { light }]] = [...reasons].sort((a, b) => b[1].rows - a[1].rows);
  return [light, good ? `in force ${Math.floor((1e4 * good) / rows) / 100} % of the time; ${why}` : why];
}

// How an entry ends, and what of its loads is above a limit.
function arrival(verdict) {
  const last = (column) => flight.of(column).at(-1);
  const off = (last("guidance.range") - flight.number("guidance.target.range")) / 1e3;
  const reaches = Math.abs(off) * 1e3 <= flight.number("guidance.target.tolerance");
  const place = reaches ? `reaches the terminal area after ${(stop / 60).toFixed(0)} minutes, ${Math.abs(off).toFixed(1)} km off` : `ends ${Math.abs(off).toFixed(0)} km ${off > 0 ? "short" : "long"}`;
  const over = LOADS.filter(([column, name]) => Math.max(...flight.of(column)) > flight.number(`guidance.limit.${name}`) * MET);
  const loads = over.length ? `exceeds the limit of ${over.map(([, name]) => ({ heatFlux: "heat flux", load: "load", pressure: "dynamic pressure" })[name]).join(" and ")}` : "within its loads";
  return `${verdict}. The vehicle ${place}, ${loads}`;
}

function judge(limits) {
  const { summary, name } = flight;
  const over = [["rate", summary.rate_ratio], ["moment", summary.moment_ratio]].filter(([, ratio]) => ratio > MET);
  const percent = (ratio) => `${(100 * ratio).toFixed(0)} %`;
  let verdict = `${name} keeps both limits, of rate and moment`;
  if (over.length) verdict = `${name} exceeds the ${over.map(([limit, ratio]) => `${limit} limit (${percent(ratio)})`).join(" and the ")}`;
  if (flight.isEntry && !summary.end) verdict = arrival(verdict);
  if (summary.end) verdict = `${summary.lost ? `${name} loses the attitude` : "The flight ends"} at ${summary.end.time.toFixed(1)} s`;
  $("verdict").textContent = $("arrival").textContent = verdict[0].toUpperCase() + verdict.slice(1);
  const other = flight.ghost?.summary;
  const row = (label, middle, value, of) => `<dt>${label}</dt>${middle}<dd${middle ? "" : ' class="wide"'}>${value(summary)}</dd>
    ${other ? `<dd class="other">${of ? percent(other[of]) : value(other)}</dd>` : ""}`;
  const meter = (label, of, limit, unit, digits) => `<div class="${summary[of] > MET ? "over" : ""}">${row(label,
    `<dd class="meter"><i style="width:${Math.min(100, (summary[of] * 200) / 3)}%"></i></dd>`,
    (each) => `${(each[of] * limit).toFixed(digits)} of ${limit.toFixed(digits)} ${unit}`, of)}</div>`;
  const [light, text] = guarantee();
  $("figures").classList.toggle("compared", Boolean(other));
  $("figures").innerHTML = `
    ${other ? `<div><dt></dt><dd class="wide">${name.split(" with ")[0]}</dd><dd class="other">${flight.ghost.name}</dd></div>` : ""}
    ${meter("Largest rate", "rate_ratio", limits.rate, "deg/s", 2)}
    ${meter("Largest moment", "moment_ratio", limits.moment, "kN m", 1)}
    <div>${row("EMS", "", (each) => `${(each.ems * DEG).toFixed(3)} deg`)}</div>
    <div>${row("CMS", "", (each) => each.cms.toFixed(4))}</div>
    <div><dt>Guarantee</dt><dd class="wide ${light}"><i class="light"></i>${text}</dd>${other ? "<dd></dd>" : ""}</div>`;
  const said = [...summary.warnings, ...(summary.end ? [summary.end] : [])];
  $("messages").hidden = said.length === 0;
  $("messages").open ||= summary.end !== null;
  $("messages").querySelector("summary").textContent = said.length === 1 ? "One message" : `${said.length} messages`;
  $("messages").querySelector("ul").replaceChildren(...said.slice(0, 20).map(({ time: at, text: words }) => {
    const entry = document.createElement("li");
    entry.textContent = `${at.toFixed(2)} s: ${words}`;
    return entry;
  }));
}

// --- The chosen time ------------------------------------------------------------------------------------------------

function point(at) {
  time = at;
  player.show(time);
  if (!flight) return;
  for (const chart of Object.values(charts)) if (!chart.figure.hidden) chart.point(at);
  if (flight.isEntry) entry.point(at);
  proof.point(at);
  pose(at);
}

// Shows the vehicle as it flies at a time.
function pose(at) {
  if (!flight.rows) return;
  const row = rowAt(flight.time, at);
  const from = row * flight.width;
  const part = (first) => Array.from(flight.signals.subarray(from + first, from + first + 3));
  const [now, why] = standing(row);
  const text = now === undefined ? "no guarantee" : `guarantee ${why?.split(":")[0] ?? (now === "pending" ? "pending" : "in force")}`;
  view.show({
    angles: part(1), reference: part(7), light: { state: LIGHTS[now] ?? "none", text },
  });
}

// --- The settings ---------------------------------------------------------------------------------------------------

function say(text, wrong = false) {
  $("said").textContent = text;
  $("said").classList.toggle("wrong", wrong);
}

let latest = { what: "", at: 0 };

function changed(names, value, needs = {}, what = names.join()) {
  for (const name of names) settings.change(name, value);
  for (const [name, needed] of Object.entries(needs)) settings.change(name, needed);
  // Going back undoes a change, but all of a value that is being dragged or a text that is being written.
  const now = performance.now();
  const goesOn = what !== "" && what === latest.what && now - latest.at < 1000;
  history[goesOn ? "replaceState" : "pushState"](null, "", `#${settings.address()}`);
  latest = { what, at: now };
  mark();
  fly();
}

// Names of rows whose values differ from the scenario.
function mark() {
  for (const row of document.querySelectorAll(".row")) {
    row.classList.toggle("changed", row.dataset.names.split(" ").some((name) => name in settings.set));
  }
}

function build() {
  $("controller").value = settings.choice.id;
  for (const [id, button] of [["attitude", $("fly-attitude")], ["entry", $("fly-entry")]]) button.setAttribute("aria-pressed", id === settings.flight);
  document.body.classList.toggle("entry", settings.isEntry);
  const open = new Set([...$("groups").querySelectorAll("details[open]")].map((group) => group.dataset.title.split(" of ")[1]));
  $("groups").replaceChildren(...settings.groups().map(([title, rows, folded]) => {
    const group = document.createElement(folded ? "details" : "fieldset");
    group.dataset.title = title;
    const head = document.createElement(folded ? "summary" : "legend");
    head.textContent = title;
    if (folded && open.has(title.split(" of ")[1])) group.open = true;
    group.append(head, ...rows.map(control));
    return group;
  }));
  settings.own.show(settings.choice.id === OWN);
  mark();
}

function control({ names, label, low, high, exact, needs }) {
  const parameter = settings.parameters.get(names[0]);
  const row = document.createElement("div");
  row.className = "row";
  row.dataset.names = names.join(" ");
  const id = `set-${names[0]}`;
  const caption = document.createElement("label");
  caption.htmlFor = id;
  // Names of variables are broken at their dots.
  label.split(/(?<=\.)/).forEach((part, i) => caption.append(...(i ? [document.createElement("wbr")] : []), part));
  caption.title = parameter.variable.description;
  const { type, kind } = parameter;
  let input;
  if (type === "Enumeration") {
    input = document.createElement("select");
    for (const [name, meaning] of kind.of.items.filter(([name]) => !/^(table|external)$/.test(name))) {
      const option = new Option(name, name);
      option.title = meaning;
      input.add(option);
    }
    const value = settings.value(names[0]);
    // An address may have an item that the page does not offer.
    if (![...input.options].some((option) => option.value === value)) input.add(new Option(value, value));
    input.value = value;
    input.onchange = () => changed(names, input.value);
  } else {
    input = document.createElement("input");
    if (type === "Boolean") {
      input.type = "checkbox";
      input.checked = settings.value(names[0]) === true;
      input.onchange = () => changed(names, input.checked);
    } else {
      number(input, parameter, { names, low, high, exact: exact || type === "Integer", needs });
    }
  }
  input.id = id;
  row.append(caption, input);
  if (input.type === "range") {
    const shown = document.createElement("output");
    shown.htmlFor = id;
    const write = () => {
      const text = `${Number(input.chosen().toPrecision(4))} ${parameter.unit}`.replace("-", "−").trim();
      shown.textContent = text;
      input.setAttribute("aria-valuetext", text);
    };
    input.addEventListener("input", write);
    write();
    row.append(shown);
  } else {
    row.classList.add("plain");
    if (exact && parameter.unit) caption.append(`, ${parameter.unit}`);
  }
  return row;
}

function number(input, parameter, { names, low, high, exact, needs }) {
  const { kind, type } = parameter;
  const value = parameter.shown(settings.value(names[0]));
  if (exact) {
    input.type = "number";
    input.step = type === "Integer" ? 1 : "any";
    if (kind.min !== null) input.min = parameter.shown(kind.min);
    if (kind.max !== null) input.max = parameter.shown(kind.max);
    input.value = value;
    input.oninput = () => {
      if (!input.checkValidity()) say(`${parameter.name}: ${input.validationMessage}`, true);
      else if (input.value !== "") changed(names, parameter.written(input.valueAsNumber));
    };
    return;
  }
  input.type = "range";
  const step = Chart.step(high - low, 200);
  // A value that is not a number in the unit is refused, and the slider stays where it is.
  if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  input.min = low;
  input.max = high;
  // The initial value is one of the steps.
  input.step = Number.isInteger(Number(((value - low) / step).toFixed(6))) ? step : "any";
  input.value = value;
  // The value that is shown and flown: a round one, or the initial value.
  input.chosen = () => {
    const at = input.valueAsNumber;
    if (input.step !== "any" || at === value) return at;
    return Math.min(high, Math.max(low, Number((Math.round(at / step) * step).toPrecision(10))));
  };
  input.oninput = () => changed(names, parameter.written(input.chosen()), needs);
}

// Another flight begins: its own time, nothing of the one before, and nothing beside an entry, which would take twice
// as long.
function begun() {
  flight = null;
  $("proof").hidden = $("entry").hidden = true;
  $("arrival").textContent = "";
  $("verdict").textContent = "Computing …";
  $("ghost").value = settings.isEntry ? "" : "lqr";
  time = settings.isEntry ? 900 : 26;
  player.pace(settings.isEntry ? 1500 : 50);
  for (const chart of Object.values(charts)) chart.zoomed = null;
}

function load(address) {
  const before = settings.flight;
  try {
    const unknown = settings.read(address);
    remark = unknown.length ? { text: `Unknown here: ${unknown.join(", ")}` } : null;
  } catch (error) {
    remark = { text: `${error.message}: this is ${settings.description.controllers[0].name}`, wrong: true };
    settings.read("");
    history.replaceState(null, "", `#${settings.address()}`);
  }
  if (settings.flight !== before) begun();
  build();
  fly();
}

// --- Beginning and leaving ------------------------------------------------------------------------------------------

function begin({ text, error }) {
  if (error) return say(`The flights cannot be computed: ${error}`, true);
  settings = new Settings(JSON.parse(text));
  const { controllers, version } = settings.description;
  for (const { id, name, fmu } of controllers) {
    const option = new Option(name, id);
    option.title = settings.description.fmus[fmu].description;
    $("controller").add(option);
    $("ghost").add(new Option(name, id));
  }
  $("ghost").add(new Option("nothing", ""));
  $("ghost").value = "lqr";
  proof = new Proof();
  settings.own.listen();
  $("version").textContent = version;
  player.pace(50);
  point(time);
  load(location.hash.slice(1));
}

async function save() {
  const scribe = new Pilot(compiled);
  const { text, error } = await scribe.ask("experiment", settings.request());
  scribe.dismiss();
  if (error) return say(error, true);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
  link.download = `${settings.choice.id}.toml`;
  link.click();
  URL.revokeObjectURL(link.href);
  say(`orchestrator run ${link.download} flies this with the same bits.`);
}

$("controller").onchange = () => {
  settings.choose($("controller").value);
  build();
  changed([], null);
};
for (const id of ["attitude", "entry"]) {
  $(`fly-${id}`).onclick = () => {
    settings.fly(id);
    begun();
    build();
    changed([], null);
  };
}
$("ghost").onchange = () => { if (flight) { compare(); show(); } };
$("reset").onclick = () => {
  settings.set = {};
  settings.choose(settings.choice.id);
  build();
  changed([], null);
};
$("copy").onclick = async () => {
  try {
    await navigator.clipboard.writeText(location.href);
    say("Copied. The address holds all settings.");
  } catch {
    say("The address of this page holds all settings; this browser does not let the page copy it.");
  }
};
$("save").onclick = save;
window.addEventListener("hashchange", () => load(location.hash.slice(1)));
for (const what of ["(prefers-color-scheme: dark)", "print"]) matchMedia(what).addEventListener("change", () => flight && show());

pilot.ask("describe").then(begin, (error) => say(`The flights cannot be computed: ${error.message}`, true));
