/** A driver's hands: keys, buttons on the screen or a gamepad become steering and speed, as smoothly as a hand turns a wheel. */
export type Pedal = "left" | "right" | "gas" | "brake";

export const KEYS: Record<string, Pedal> = {
  ArrowLeft: "left",
  ArrowRight: "right",
  ArrowUp: "gas",
  ArrowDown: "brake",
  a: "left",
  d: "right",
  w: "gas",
  s: "brake",
  A: "left",
  D: "right",
  W: "gas",
  S: "brake",
  " ": "brake",
};

const LOCK = Math.PI / 6; // rad
const TURNING = 3.2; // rad/s
const STRAIGHTENING = 5;
const SPEEDING = 3.5; // m/s²
const COASTING = 1.5;
const BRAKING = 8;

const towards = (from: number, to: number, step: number) =>
  from < to ? Math.min(to, from + step) : Math.max(to, from - step);

export class Driver {
  readonly held = new Set<Pedal>();
  top = 2.5; // m/s
  steering = 0;
  speed = 0;

  get isDriving(): boolean {
    return this.held.has("gas") || (pad()?.gas ?? 0) > 0.05;
  }

  /** What is asked for after some more seconds. */
  advance(seconds: number): { steering: number; speed: number } {
    const stick = pad();
    // at speed a hand turns the wheel less
    const lock = LOCK * (1 - 0.4 * Math.min(1, this.speed / 4));
    const side = Number(this.held.has("left")) - Number(this.held.has("right"));
    if (stick && Math.abs(stick.side) > 0.06) this.steering = -stick.side * lock;
    else this.steering = towards(this.steering, side * lock, (side ? TURNING : STRAIGHTENING) * seconds);
    if (this.held.has("brake") || (stick?.brake ?? 0) > 0.2) this.speed = towards(this.speed, 0, BRAKING * seconds);
    else if (stick && stick.gas > 0.05) this.speed = towards(this.speed, stick.gas * this.top, SPEEDING * seconds);
    else if (this.held.has("gas")) this.speed = towards(this.speed, this.top, SPEEDING * seconds);
    else this.speed = towards(this.speed, 0, COASTING * seconds);
    return { steering: this.steering, speed: this.speed < 0.05 ? 0 : this.speed };
  }

  rest(): void {
    this.held.clear();
    this.steering = this.speed = 0;
  }
}

function pad(): { side: number; gas: number; brake: number } | undefined {
  if (typeof navigator === "undefined" || !navigator.getGamepads) return undefined;
  const found = navigator.getGamepads().find((one) => one?.connected && one.mapping === "standard");
  return found
    ? {
        side: found.axes[0] ?? 0,
        gas: Math.max(found.buttons[7]?.value ?? 0, found.buttons[0]?.value ?? 0),
        brake: Math.max(found.buttons[6]?.value ?? 0, found.buttons[1]?.value ?? 0),
      }
    : undefined;
}

/** Seconds behind a ghost (negative: ahead), by where it was at the same place; and its step there. */
export function behind(
  trace: number[][],
  pose: number[],
  clock: number,
  near: number,
): { seconds: number; step: number } {
  let [best, step] = [Infinity, near];
  for (let index = Math.max(0, near - 30); index < Math.min(trace.length, near + 60); index++) {
    const away = Math.hypot(trace[index]![0]! - pose[0]!, trace[index]![1]! - pose[1]!);
    if (away < best) [best, step] = [away, index];
  }
  return { seconds: clock - (step + 1) / 15, step };
}
