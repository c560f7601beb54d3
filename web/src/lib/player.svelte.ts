/** What plays a lap: a clock in seconds that runs, is held, and is set by hand. */
export class Player {
  time = $state(0);
  isPlaying = $state(false);
  pace = $state(1);
  #frame = 0;
  #last = 0;

  /** `end`: the last moment, in s; `loops`: begin again there instead of stopping. */
  constructor(
    readonly end: () => number,
    readonly loops = false,
  ) {}

  /** Begin, from the start where it is at its end, or hold. */
  toggle(): void {
    if (this.isPlaying) return this.hold();
    if (this.time >= this.end() - 0.01) this.time = 0;
    this.isPlaying = true;
    this.#last = performance.now();
    this.#frame = requestAnimationFrame(this.#step);
  }

  hold(): void {
    this.isPlaying = false;
    cancelAnimationFrame(this.#frame);
  }

  readonly #step = (moment: number) => {
    if (!this.isPlaying) return;
    this.time += (Math.min(moment - this.#last, 200) / 1000) * this.pace;
    this.#last = moment;
    if (this.time >= this.end()) {
      this.time = this.loops ? 0 : this.end();
      this.isPlaying = this.loops;
    }
    if (this.isPlaying) this.#frame = requestAnimationFrame(this.#step);
  };
}
