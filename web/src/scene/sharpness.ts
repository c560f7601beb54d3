/** How sharp to draw: as sharp as the screen while that is fast, and coarser while it is slow.
 *
 * Frames are judged by the median of their times, so that one that takes long means nothing. After a try at sharper
 * pictures that was too slow, the next one comes later and later.
 */
const SLOW = 31; // ms a frame: fewer than 30 a second are near
const FAST = 19; // ms a frame
const WINDOW = 10; // frames that are judged together
const STEP = 0.8; // of the pixels' number along a side
const MOST_PATIENCE = 64; // windows
const ABSENT = 500; // ms a frame: nobody looked

export class Sharpness {
  /** Pixels of the picture per CSS pixel, along a side. */
  ratio: number;
  private times: number[] = [];
  private patience = 4; // fast windows before a sharper picture is tried
  private fast = 0;
  private isTrying = false;

  constructor(
    readonly finest: number,
    private readonly coarsest: number,
    start: number,
  ) {
    this.ratio = Math.min(Math.max(start, coarsest), finest);
  }

  /** Learn how long a frame took, in ms. */
  took(time: number): void {
    if (time > ABSENT) return;
    this.times.push(time);
    if (this.times.length < WINDOW) return;
    const median = this.times.sort((a, b) => a - b)[WINDOW / 2]!;
    this.times = [];
    this.fast = median < FAST ? this.fast + 1 : 0;
    if (median > SLOW) {
      if (this.isTrying) this.patience = Math.min(2 * this.patience, MOST_PATIENCE);
      this.change(this.ratio * STEP, false);
    } else if (this.fast >= this.patience) this.change(this.ratio / STEP, true);
  }

  private change(wanted: number, isTrying: boolean): void {
    this.ratio = Math.min(Math.max(wanted, this.coarsest), this.finest);
    [this.fast, this.isTrying] = [0, isTrying];
  }
}
