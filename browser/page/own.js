// A law that is written on the page: its text, and where its faults are.
"use strict";

const OWN = "own";
const EXAMPLE = `function law(state, reference, dt, memory, vehicle) {
  const kp = 0.5, kd = 1.5; // 1/s², 1/s
  const acceleration = [0, 1, 2].map((i) =>
    reference.accelerations[i]
    - kp * (state.angles[i] - reference.angles[i])
    - kd * (state.angleRates[i] - reference.rates[i]));
  return vehicle.momentFor(acceleration);
}
`;

class OwnLaw {
  constructor() {
    this.code = EXAMPLE;
    // Texts that were written here or that the reader has agreed to: a text of an address is not run unasked.
    this.agreed = new Set([EXAMPLE]);
    this.waiting = null;
  }

  get isAgreed() {
    return this.agreed.has(this.code);
  }

  agree() {
    this.agreed.add(this.code);
    $("agree").hidden = true;
  }

  // Shows the editor, or hides it while another controller is chosen.
  show(isChosen) {
    $("own").hidden = !isChosen;
    $("save").disabled = isChosen;
    if ($("code").value !== this.code) $("code").value = this.code;
    $("agree").hidden = this.isAgreed;
  }

  listen() {
    $("code").oninput = () => {
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => {
        this.code = $("code").value;
        this.agree();
        changed([], null, {}, "law");
      }, 400);
    };
    $("agree").onclick = () => { this.agree(); fly(); };
  }

  // Says a fault, and selects the line that it is in.
  say(fault, line) {
    $("code-says").textContent = fault;
    const text = $("code");
    if (!line || document.activeElement === text) return;
    const lines = text.value.split("\n");
    const from = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
    text.setSelectionRange(from, from + (lines[line - 1]?.length ?? 0));
  }

  // A text that is no program has its fault where another worker finds it: only there browsers tell the line.
  static line(code) {
    return new Promise((found) => {
      const address = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
      const reader = new Worker(address);
      const end = (line) => { reader.terminate(); URL.revokeObjectURL(address); found(line); };
      reader.onerror = (event) => { event.preventDefault(); end(event.lineno || null); };
      setTimeout(() => end(null), 500);
    });
  }
}
