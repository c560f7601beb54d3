/** Action spaces as people edit them: degrees and m/s, within what the car can do. */
import type { Action, ActionPreset } from "../api/client";

export const MAX_STEERING = 30; // degrees; the car's front wheels turn no further
export const MAX_FILE_STEERING = 45; // degrees; files of 2018 have it: rewards and logs say so
export const [MIN_SPEED, MAX_SPEED] = [0.1, 4];
export const [MIN_ACTIONS, MAX_ACTIONS] = [2, 30];
export const REACH = 92; // px of the fastest arrow

export const clamp = (value: number, low: number, high: number) => Math.min(Math.max(value, low), high);

/** How far actions may steer: as the wheels do, or where a file says more, as such files may. */
export const reachOf = (actions: Action[]): number =>
  actions.some((action) => Math.abs(action.steering_angle) > MAX_STEERING) ? MAX_FILE_STEERING : MAX_STEERING;

/** An action the car can do, in half degrees and twentieths of a metre a second. */
export const tidy = (action: Action, reach = MAX_STEERING): Action => ({
  steering_angle: clamp(Math.round(action.steering_angle * 2) / 2, -reach, reach) + 0,
  speed: clamp(Math.round(action.speed * 20) / 20, MIN_SPEED, MAX_SPEED),
});

/** The same action as somebody changed it; what they left as it was keeps all its digits. */
export function changed(before: Action, to: Action, reach = MAX_STEERING): Action {
  const tidied = tidy(to, reach);
  return {
    steering_angle: to.steering_angle === before.steering_angle ? before.steering_angle : tidied.steering_angle,
    speed: to.speed === before.speed ? before.speed : tidied.speed,
  };
}

/** The speed that the longest arrow stands for: room to pull beyond the fastest action. */
export const scaleOf = (actions: Action[]): number =>
  [1, 1.5, 2.5].find((top) => actions.every((action) => action.speed <= top)) ?? MAX_SPEED;

/** Round speeds for the rings of the picture. */
export function rings(top: number): number[] {
  const step = top <= 1 ? 0.25 : top <= 2.5 ? 0.5 : 1;
  return Array.from({ length: Math.round(top / step) }, (_, index) => (index + 1) * step);
}

/** Where an arrow ends on the picture; steering is drawn twice as wide as it is. */
export function tip(action: Action, top: number): [number, number] {
  const turn = (2 * action.steering_angle * Math.PI) / 180;
  const length = (REACH * action.speed) / top;
  return [100 - Math.sin(turn) * length, 108 - Math.cos(turn) * length];
}

/** The action whose arrow ends at a place. */
export function actionAt(x: number, y: number, top: number): Action {
  const [left, up] = [100 - x, 108 - y];
  const turn = Math.atan2(left, Math.max(up, 1e-6));
  return tidy({ steering_angle: (turn * 90) / Math.PI, speed: (Math.hypot(left, up) / REACH) * top });
}

/** Every angle with every speed, as the original's console makes them. */
export function grid(maxSteering: number, angles: number, maxSpeed: number, speeds: number): Action[] {
  const found: Action[] = [];
  for (let angle = 0; angle < angles; angle++)
    for (let speed = 1; speed <= speeds; speed++)
      found.push({
        steering_angle: angles > 1 ? -maxSteering + (2 * maxSteering * angle) / (angles - 1) : 0,
        speed: (maxSpeed * speed) / speeds,
      });
  return found;
}

/** Of numbers that were turned into radians and back; what differs by more is carried as it is. */
const near = (a: number, b: number) => Math.abs(a - b) < 1e-9;

export const sameSpace = (a: ActionPreset, b: ActionPreset): boolean =>
  a.kind === b.kind &&
  a.actions.length === b.actions.length &&
  a.actions.every(
    (action, index) =>
      near(action.steering_angle, b.actions[index]!.steering_angle) && near(action.speed, b.actions[index]!.speed),
  ) &&
  (a.kind === "discrete" ||
    [...(a.steering_angle ?? []), ...(a.speed ?? [])].every((value, index) =>
      near(value, [...(b.steering_angle ?? []), ...(b.speed ?? [])][index]!),
    ));

const VERSION = "5"; // of the original's simulator
const OLD = "2"; // whose files may say more than the wheels turn

/** The original's document of an action space, with the version of its simulator that has such actions. */
export const metadataOf = (space: ActionPreset): Record<string, unknown> =>
  space.kind === "discrete"
    ? {
        version: reachOf(space.actions) > MAX_STEERING ? OLD : VERSION,
        action_space_type: "discrete",
        action_space: space.actions.map((action, index) => ({ ...action, index })),
      }
    : {
        version: VERSION,
        action_space_type: "continuous",
        action_space: {
          steering_angle: { low: space.steering_angle![0], high: space.steering_angle![1] },
          speed: { low: space.speed![0], high: space.speed![1] },
        },
      };
