// The flights, computed beside the page. A message is { call, id, request, code } or, first, { module }; its answer has
// the same call and id. The code is the text of the page's own law.
"use strict";

// The page's own law, what it keeps between ticks, and its fault in the flight that is computed.
let law = null, kept = {}, fault = null;

function compile(code) {
  [law, kept, fault] = [null, {}, null];
  // The text begins in the first line, so that its faults have its own line numbers.
  const program = `(function () { "use strict"; ${code}\nreturn typeof law === "function" ? law : null; })()\n//# sourceURL=own-law.js`;
  law = (0, eval)(program);
  if (!law) throw new Error("there is no function named law");
}

// A tick of the law. After a fault it gives no moment, which ends the flight.
function ask(given, moment) {
  const numbers = new Float64Array(exports.memory.buffer, given, 34);
  const three = (from) => Array.from(numbers.subarray(from, from + 3));
  const [rest, columns] = [three(22), [25, 28, 31].map(three)];
  const out = [NaN, NaN, NaN];
  if (!fault) {
    try {
      const answer = law(
        { time: numbers[0], angles: three(1), rates: three(4), angleRates: three(7) },
        { angles: three(10), rates: three(13), accelerations: three(16) },
        numbers[21],
        kept,
        {
          limitRate: numbers[19],
          limitMoment: numbers[20],
          momentFor: (wanted) => rest.map((value, i) => value + columns.reduce((sum, column, j) => sum + column[i] * wanted[j], 0)),
        },
      );
      if (!Array.isArray(answer) || answer.length !== 3 || !answer.every(Number.isFinite)) {
        throw new Error(`at ${numbers[0].toFixed(2)} s it returns ${JSON.stringify(answer)}: three finite numbers are needed`);
      }
      out.splice(0, 3, ...answer);
    } catch (error) {
      fault = { error };
    }
  }
  new Float64Array(exports.memory.buffer, moment, 3).set(out);
}

// What the page says of a fault of its law, with the line if the browser tells it.
function told(error) {
  const line = /own-law\.js:(\d+)/.exec(error?.stack ?? "")?.[1] ?? (error?.fileName?.includes("own-law.js") ? error.lineNumber : null);
  return { error: `your law${line ? `, line ${line}` : ""}: ${error?.message ?? `it throws ${String(error)}`}`, line: Number(line) || null, isSyntax: error instanceof SyntaxError };
}

let exports = null;

function load(module) {
  // A dependency would ask a browser for the time, and has the glue of wasm-bindgen for that. Nothing here depends on
  // time, so it gets zero.
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = from === "page" ? ask : () => 0;
  return () => { exports = new WebAssembly.Instance(module, imports).exports; };
}

let start = null;

function call(name, request) {
  const bytes = new TextEncoder().encode(JSON.stringify(request ?? null));
  const address = exports.reserve(bytes.length);
  // A call that needs more memory replaces the buffer, so it is asked for after the call.
  new Uint8Array(exports.memory.buffer, address, bytes.length).set(bytes);
  const right = exports[name]() === 1;
  const memory = exports.memory.buffer;
  const text = new TextDecoder().decode(new Uint8Array(memory, exports.answer(), exports.answer_length()));
  if (!right) throw new Error(text);
  const signals = new Float64Array(memory, exports.signals(), exports.signals_length()).slice();
  const plans = new Float64Array(memory, exports.plans(), exports.plans_length()).slice();
  return { text, signals, plans };
}

onmessage = ({ data }) => {
  const begun = performance.now();
  const { call: name, id } = data;
  const isOwn = name === "fly" && data.request.controller === "own";
  const answer = (content, ...moved) => postMessage({ call: name, id, ...content }, moved);
  try {
    if (data.module) {
      start = load(data.module);
      return start();
    }
    if (isOwn) compile(data.code);
    const { text, signals, plans } = call(name, data.request);
    if (isOwn && fault) return answer(told(fault.error));
    answer({ text, signals, plans, ms: performance.now() - begun }, signals.buffer, plans.buffer);
  } catch (error) {
    // After a trap the memory may be in any state.
    if (error instanceof WebAssembly.RuntimeError) start();
    answer(isOwn && (fault || !law) ? told(fault ? fault.error : error) : { error: error.message });
  }
};
