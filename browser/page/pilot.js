// Flights are computed beside the page. A text of the page's own law may spoil the worker that runs it, so each text has
// one of its own.
//
//   const pilot = new Pilot(module);                   // the compiled module, or a promise of it
//   const answer = await pilot.ask(call, request, code);
//   pilot.dismiss();
//
// An answer is { error } or what the call gives; null if the pilot was dismissed meanwhile. The code is the text of the
// page's own law, or null where it does not fly.
"use strict";

class Pilot {
  // Longest time that a flight of a law of the page may take, ms.
  static LONGEST = 1e4;

  constructor(module) {
    Object.assign(this, { module, worker: null, code: null, waiting: new Map(), count: 0 });
  }

  async ask(call, request = null, code = null) {
    const module = await this.module;
    if (!this.worker || code !== this.code) this.employ(module, code);
    const id = this.count++;
    const tooLong = { error: "your law: a flight takes more than ten seconds" };
    const overdue = code === null ? null : setTimeout(() => this.dismiss(tooLong), Pilot.LONGEST);
    const answer = new Promise((answered) => { this.waiting.set(id, answered); });
    this.worker.postMessage({ call, id, request, code });
    return answer.finally(() => clearTimeout(overdue));
  }

  employ(module, code) {
    this.dismiss();
    this.code = code;
    this.worker = new Worker(URL.createObjectURL(new Blob([$("worker").textContent], { type: "text/javascript" })));
    this.worker.onmessage = ({ data }) => {
      this.waiting.get(data.id)?.(data);
      this.waiting.delete(data.id);
    };
    this.worker.onerror = ({ message }) => this.dismiss({ error: code === null ? message : `your law: ${message}` });
    this.worker.postMessage({ module });
  }

  // Ends what is computed; whoever waits gets this answer.
  dismiss(answer = null) {
    this.worker?.terminate();
    this.worker = null;
    for (const answered of this.waiting.values()) answered(answer);
    this.waiting.clear();
  }
}
