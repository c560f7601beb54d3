/** Which frames of a screen to draw: all of them, or so many a second where drawing takes from whoever learns meanwhile. */
const EARLY = 1; // ms, by which a frame may come too soon

export class Pace {
  private due = 0; // ms

  /** @param period ms between two frames that are drawn, on average */
  constructor(private readonly period: number) {}

  /** Whether to draw the frame of this time, in ms; what fell behind by more than one frame is not made up for. */
  isDue(time: number): boolean {
    if (time < this.due - EARLY) return false;
    this.due = Math.max(this.due, time - this.period) + this.period;
    return true;
  }
}
