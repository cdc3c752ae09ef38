// The time of a flight that its pictures share: it is chosen on a slider, and plays. Space plays and pauses, arrows
// seek (with Shift ten times as far), Home and End go to the ends.
//
//   const player = new Player((time) => …);    // with the elements play, seek, time and speed
//   player.range(start, stop);
//   player.pace(duration);                     // plays a flight of this duration in half a minute or less
//   player.seek(time);
"use strict";

class Player {
  static SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200];

  constructor(onTime) {
    const [play, slider, shown, speed] = ["play", "seek", "time", "speed"].map((id) => document.getElementById(id));
    Object.assign(this, { onTime, play, slider, shown, speed, time: 0, isPlaying: false });
    for (const factor of Player.SPEEDS) speed.append(new Option(`×${factor}`, factor));
    slider.step = "any";
    play.addEventListener("click", () => this.toggle());
    slider.addEventListener("input", () => this.seek(slider.valueAsNumber));
    document.addEventListener("keydown", (event) => this.pressed(event));
    this.range(0, 1);
    this.pace(1);
    this.label();
  }

  range(start, stop) {
    Object.assign(this, { start, stop });
    [this.slider.min, this.slider.max] = [start, stop];
    this.digits = Math.max(1, Math.min(4, 3 - Math.floor(Math.log10(stop - start || 1))));
  }

  pace(duration) {
    this.speed.value = Player.SPEEDS.find((factor) => factor >= 1 && duration / factor <= 30) ?? Player.SPEEDS.at(-1);
  }

  // Shows a time without asking for it; one beyond the ends is shown as the end.
  show(time) {
    this.time = Math.max(this.start, Math.min(this.stop, time));
    this.slider.value = this.time;
    this.shown.textContent = `${minus(this.time.toFixed(this.digits))} s`;
    this.slider.setAttribute("aria-valuetext", this.shown.textContent);
  }

  seek(time) {
    this.show(time);
    this.onTime(this.time);
  }

  toggle() {
    this.isPlaying = !this.isPlaying;
    this.label();
    if (!this.isPlaying) return;
    if (this.time >= this.stop) this.seek(this.start);
    // Whoever pauses and plays within a frame has two of these at a time.
    this.last = null;
    const frame = (now) => {
      if (!this.isPlaying) return;
      if (this.last !== null) this.seek(this.time + ((now - this.last) / 1000) * Number(this.speed.value));
      this.last = now;
      if (this.time >= this.stop) this.toggle();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  label() {
    this.play.textContent = this.isPlaying ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
  }

  pressed(event) {
    const { key, target } = event;
    // Elements with keys of their own keep them: a search, choices, a text, and a view that is turned.
    const isOwn = target.closest("input:not(#seek), select, textarea, summary, button:not(#play)");
    if (event.defaultPrevented || isOwn || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = ((this.stop - this.start) / 100) * (event.shiftKey ? 10 : 1);
    const actions = {
      " ": () => this.toggle(), ArrowLeft: () => this.seek(this.time - step), ArrowRight: () => this.seek(this.time + step),
      Home: () => this.seek(this.start), End: () => this.seek(this.stop),
    };
    if (!actions[key]) return;
    event.preventDefault();
    actions[key]();
  }
}
