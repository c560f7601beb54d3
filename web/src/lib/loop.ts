import type { Demonstration } from "../api/client";
import type { Look } from "../scene/poses";

const STEP = 1000 / 15; // ms
const PAUSE = 15; // steps that the car stands at the end before it begins again

/** A lap that is driven again and again: what is seen of it so many milliseconds after it first began. */
export function lookAt(lap: Demonstration, elapsed: number): Look {
  const place = Math.floor(elapsed / STEP) % (lap.poses.length + PAUSE);
  const now = Math.min(place, lap.poses.length - 1);
  return {
    step: lap.step,
    poses: [lap.poses[now]!],
    steps: [now],
    policy: [],
    is_discrete: true,
    focus: 0,
  };
}
