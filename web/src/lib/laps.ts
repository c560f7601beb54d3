/** Laps of an evaluation: where a car was at a moment, and two laps on one axis of place. */
import type { components } from "../api/schema";

export type LapTrace = components["schemas"]["LapTrace"];
export type RoadObject = components["schemas"]["RoadObject"];
export type EvaluationLaps = components["schemas"]["EvaluationLaps"];

export const PLACES = 241;

/** Index of the last entry that is not above a value, in a list that never falls. */
export function before(list: number[], value: number): number {
  let [low, high] = [0, list.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (list[middle]! <= value) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** Runs of rows in which the car drove from one to the next, from the first of each to behind its last. */
export function drives(lap: { puts: number[]; x: number[] }): [number, number][] {
  const cuts = [0, ...lap.puts, lap.x.length];
  return cuts.slice(1).map((end, index) => [cuts[index]!, end]);
}

/** Value of a column where another one, which never falls, has a value; straight in between. */
export function interpolate(at: number, along: number[], values: number[] | ((row: number) => number)): number {
  const value = typeof values === "function" ? values : (at: number) => values[at]!;
  const row = before(along, at);
  const next = Math.min(row + 1, along.length - 1);
  const width = along[next]! - along[row]!;
  const share = width > 0 ? Math.min(Math.max((at - along[row]!) / width, 0), 1) : 0;
  return value(row) + (value(next) - value(row)) * share;
}

/** Where a lap's car is so many seconds after its start; it waits at the end. */
export function poseAt(lap: LapTrace, seconds: number): { x: number; y: number; heading: number; share: number } {
  const row = before(lap.time, seconds);
  const next = Math.min(row + 1, lap.time.length - 1);
  const jump = lap.puts.includes(next);
  const width = lap.time[next]! - lap.time[row]!;
  const share = jump || width <= 0 ? 0 : Math.min(Math.max((seconds - lap.time[row]!) / width, 0), 1);
  const turn = Math.atan2(
    Math.sin(lap.heading[next]! - lap.heading[row]!),
    Math.cos(lap.heading[next]! - lap.heading[row]!),
  );
  const heading = lap.heading[row]! + turn * share;
  const [x, y] = [
    lap.x[row]! + (lap.x[next]! - lap.x[row]!) * share,
    lap.y[row]! + (lap.y[next]! - lap.y[row]!) * share,
  ];
  // a trace speaks of the point 0.14 m ahead of the car's middle
  return {
    x: x - 0.14 * Math.cos(heading),
    y: y - 0.14 * Math.sin(heading),
    heading,
    share: interpolate(seconds, lap.time, lap.share),
  };
}

/** Boxes and other cars as they were so many seconds after a lap's start. */
export const objectsAt = (lap: LapTrace, seconds: number) => roadAt(lap.objects, before(lap.time, seconds));

/** What is on a road as it is in a step; it stays where it is when nobody drives any more. */
export const roadAt = (objects: RoadObject[], step: number) =>
  objects.map(({ kind, x, y, heading }) => {
    const at = Math.min(step, x.length - 1);
    return { kind, x: x[at]!, y: y[at]!, heading: heading[at]! };
  });

/** Values of a column at equal shares of the lap, null beyond where it ended. */
export function alongLap(lap: LapTrace, values: (number | null)[]): (number | null)[] {
  const last = lap.share[lap.share.length - 1]!;
  return Array.from({ length: PLACES }, (_, index) => {
    const share = index / (PLACES - 1);
    if (share > last + 1e-6) return null;
    const row = before(lap.share, share);
    const known = values[row] === null ? values[Math.min(row + 1, values.length - 1)] : values[row];
    if (known === null || known === undefined) return null;
    const [from, to] = [values[row] ?? known, values[Math.min(row + 1, values.length - 1)] ?? known];
    return interpolate(share, lap.share, (at) => (at === row ? from : to));
  });
}

/** Seconds by which a lap is behind another at equal shares of the lap. */
export function timeDelta(lap: LapTrace, against: LapTrace): (number | null)[] {
  const [mine, theirs] = [alongLap(lap, lap.time), alongLap(against, against.time)];
  return mine.map((value, index) => (value === null || theirs[index] == null ? null : value - theirs[index]!));
}

/** Laps from the fastest complete one on; those that were not completed by how far they came. */
export const byPace = (laps: LapTrace[]): LapTrace[] =>
  [...laps].sort(
    (a, b) =>
      Number(b.is_complete) - Number(a.is_complete) ||
      (a.is_complete ? a.seconds - b.seconds : b.share.at(-1)! - a.share.at(-1)!),
  );

export interface CornerRow {
  number: number;
  turn: number;
  apex: number;
  seconds: number | null;
  best: number | null;
  lost: number | null;
  entry: number | null;
  slowest: number | null;
  exit: number | null;
}

/** A lap corner by corner, against the best passage of all laps. */
export function cornerReport(laps: EvaluationLaps, lap: LapTrace): CornerRow[] {
  return laps.sectors.map((sector, index) => {
    const times = laps.laps.map((other) => other.passages[index]?.seconds).filter((seconds) => seconds !== undefined);
    const mine = lap.passages[index];
    const best = times.length ? Math.min(...times) : null;
    return {
      number: sector.number,
      turn: sector.turn,
      apex: sector.apex,
      seconds: mine?.seconds ?? null,
      best,
      lost: mine && best !== null ? mine.seconds - best : null,
      entry: mine?.entry_speed ?? null,
      slowest: mine?.slowest ?? null,
      exit: mine?.exit_speed ?? null,
    };
  });
}

/** A lap as what compares laps has it: by places along the centre line of so many metres. */
export const placed = (lap: LapTrace, length: number) => ({
  place: lap.share.map((share) => lap.start + share * length),
  ...{ time: lap.time, speed: lap.speed, x: lap.x, y: lap.y, puts: lap.puts },
});
