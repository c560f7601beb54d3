import type { Demonstration } from "../api/client";
import type { Look } from "../scene/poses";
import { roadAt } from "./laps";

const STEP = 1000 / 15; // ms
const PAUSE = 15; // steps that the car stands at the end before it begins again

/** A lap that is driven again and again, among what was met on it: what is seen so many milliseconds after it first began. */
export function lookAt(lap: Demonstration, elapsed: number): Look {
  const place = Math.floor(elapsed / STEP) % (lap.poses.length + PAUSE);
  const now = Math.min(place, lap.poses.length - 1);
  return {
    step: lap.step,
    poses: [lap.poses[now]!],
    steps: [now],
    policy: [],
    is_discrete: true,
    objects: roadAt(lap.objects, now).map(({ kind, x, y, heading }) => [kind, 1000 * x, 1000 * y, 1000 * heading]),
    focus: 0,
  };
}
