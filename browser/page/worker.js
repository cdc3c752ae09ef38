// The flights, computed beside the page. A message is { call, request } or, first, { module }. `ghost` is a flight to
// compare with.
"use strict";

let exports = null;

async function load(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const module = await WebAssembly.compile(await new Response(stream).arrayBuffer());
  // A dependency would ask a browser for the time, and has the glue of wasm-bindgen for that. Nothing here depends on
  // time, so it gets zero.
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => 0;
  return () => { exports = new WebAssembly.Instance(module, imports).exports; };
}

let start = null;

function call(name, request) {
  const bytes = new TextEncoder().encode(JSON.stringify(request ?? null));
  const address = exports.reserve(bytes.length);
  // A call that needs more memory replaces the buffer, so it is asked for after the call.
  new Uint8Array(exports.memory.buffer, address, bytes.length).set(bytes);
  const right = exports[name === "ghost" ? "fly" : name]() === 1;
  const memory = exports.memory.buffer;
  const text = new TextDecoder().decode(new Uint8Array(memory, exports.answer(), exports.answer_length()));
  if (!right) throw new Error(text);
  const signals = new Float64Array(memory, exports.signals(), exports.signals_length()).slice();
  const plans = new Float64Array(memory, exports.plans(), exports.plans_length()).slice();
  return { text, signals, plans };
}

onmessage = async ({ data }) => {
  const begun = performance.now();
  try {
    if (data.module) {
      start = await load(data.module);
      start();
    }
    const { text, signals, plans } = call(data.call, data.request);
    postMessage({ call: data.call, text, signals, plans, ms: performance.now() - begun }, [signals.buffer, plans.buffer]);
  } catch (error) {
    // After a trap the memory may be in any state.
    if (error instanceof WebAssembly.RuntimeError) start();
    postMessage({ call: data.call, error: error.message });
  }
};
