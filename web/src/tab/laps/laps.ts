/** Laps as the console shows them, of the judged rows of who drove: racecraft.analysis.laps and corners, over rows instead
 * of a sim-trace. */
import type { components } from "../../api/schema";
import type { EvaluationLaps, LapTrace } from "../../lib/laps";
import type { Plan } from "../plan";
import { wrapAngle, type Road } from "../road";
import { interp } from "./bends";
import { sectorsOf, type Sector } from "./corners";

type Passage = components["schemas"]["LapPassage"];

/** One lap, or the attempt at one. */
export interface DrivenLap {
  lap: LapTrace;
  car: number; // whose it is
  rows: Float64Array[]; // judged ones, objects included
  before: Float64Array | undefined; // of a lap that was begun at speed, the row a step earlier
  from: number; // its first row among all of the car's
}

const CONTROL_DT = 1 / 15; // s
const MIN_ROWS = 5; // less is no attempt
const JUMP = 1; // m between two steps: the car was put somewhere else
const PLACES = 40; // of a sector at which the speed is looked at
const STILL = 1e-6; // m and rad; what moves less stands

/** The laps of some cars, each with all of its rows in the order driven. */
export function lapsOf(road: Road, cars: Float64Array[][], columns: string[], plan: Plan): DrivenLap[] {
  const at = Object.fromEntries(columns.map((name, index) => [name, index]));
  const status = (row: Float64Array) => plan.statuses[row[at["status"]!]!]!;
  // the step that completes a lap is its last
  const lapOf = (row: Float64Array) => row[at["lap"]!]! - Number(status(row) === "lap_complete");
  const sectors = sectorsOf(road);
  const found: DrivenLap[] = [];
  let number = 0;
  cars.forEach((all, car) => {
    for (let from = 0, to: number; from < all.length; from = to) {
      for (to = from + 1; to < all.length && lapOf(all[to]!) === lapOf(all[from]!);) to++;
      number++;
      if (to - from < MIN_ROWS) continue;
      const rows = all.slice(from, to);
      const isStanding = status(rows[0]!) === "prepare";
      const lap = traced(road, rows, { at, number, status, sectors, columns, plan });
      found.push({ lap, car, rows, from, before: isStanding ? undefined : all[from - 1] });
    }
  });
  return found;
}

/** What the console's server answers; `reward.error` until somebody has paid. */
export const reported = (road: Road, laps: DrivenLap[], track: string, isReversed: boolean): EvaluationLaps => ({
  reward: { stretch: 1, stretches: 1, is_afresh: false, error: null },
  ...{ track, length: road.length, is_reversed: isReversed, sectors: sectorsOf(road) },
  laps: laps.map(({ lap }) => lap),
});

interface About {
  at: Record<string, number>;
  number: number;
  status: (row: Float64Array) => string;
  sectors: Sector[];
  columns: string[];
  plan: Plan;
}

function traced(road: Road, rows: Float64Array[], about: About): LapTrace {
  const { at, number, status, sectors, columns, plan } = about;
  // as AWS's files have it, what prepares a start stands where the first step is
  const posed = status(rows[0]!) === "prepare" && rows[1] ? [rows[1], ...rows.slice(1)] : rows;
  const of = (name: string, from = posed) => from.map((row) => row[at[name]!]!);
  const began = of("time", rows)[0]!;
  const time = of("time", rows).map((one) => one - began);
  let most = 0;
  const share = of("progress").map((one) => (most = Math.max(most, Math.min(Math.max(one, 0), 1))));
  const [x, y] = [of("x"), of("y")];
  const isPaused = rows.map((row) => status(row) === "pause");
  const puts = rows.flatMap((_, row) =>
    row > 0 &&
    ((isPaused[row] && !isPaused[row - 1]) || Math.hypot(x[row]! - x[row - 1]!, y[row]! - y[row - 1]!) > JUMP)
      ? [row]
      : [],
  );
  const speed = paceOf(x, y, time, puts);
  const start = road.project(x[0]!, y[0]!)[0] - share[0]! * road.length;
  const lap = { time, share, speed, start };
  const last = status(rows.at(-1)!);
  return {
    ...{ number, status: last, is_complete: last === "lap_complete", ...lap, x, y, puts },
    seconds: time.at(-1)! + CONTROL_DT,
    penalty_seconds: CONTROL_DT * isPaused.filter(Boolean).length,
    heading: of("heading").map((angle) => wrapAngle(angle)),
    throttle: of("speed"),
    steering: of("steering_angle"),
    reward: rows.map(() => null),
    objects: thingsOf(rows, columns, plan),
    passages: sectors.map((sector) => passage(road, sector, lap)),
  };
}

/** Driven speed, m/s, from the places of neighbouring steps; 0 where the car was put elsewhere. */
function paceOf(x: number[], y: number[], time: number[], puts: number[]): number[] {
  const pace = x
    .slice(1)
    .map(
      (_, row) =>
        Math.hypot(x[row + 1]! - x[row]!, y[row + 1]! - y[row]!) /
        Math.max(time[row + 1]! - time[row]!, CONTROL_DT / 2),
    );
  const [before, after] = [
    [pace[0]!, ...pace],
    [...pace, pace.at(-1)!],
  ];
  for (const row of puts) [after[row - 1], before[row]] = [before[row - 1]!, 0];
  return before.map((one, row) => (one + after[row]!) / 2);
}

type Placed = Pick<LapTrace, "time" | "share" | "speed" | "start">;

/** What a lap took for a sector; null where it did not get through. */
function passage(road: Road, sector: Sector, { time, share, speed, start }: Placed): Passage | null {
  const parts = partsOf(road, sector, start);
  if (parts.some(([, high]) => high > share.at(-1)! + 1e-3)) return null;
  // a lap begins a step before its first row
  const [reached, when] = [
    [0, ...share],
    [0, ...time.map((one) => one + CONTROL_DT)],
  ];
  const at = (place: number) => (place > 0 ? interp(place, reached, when) : 0);
  const took = parts.map(([low, high]) => at(high) - at(low));
  // the standing start and a finish in one sector are no one passage: its speeds are those of the longer part
  const [low, high] = parts.reduce((best, part) => (part[1] - part[0] > best[1] - best[0] ? part : best));
  const speeds = Array.from({ length: PLACES }, (_, place) =>
    interp(low + ((high - low) * place) / (PLACES - 1), share, speed),
  );
  return {
    seconds: took.reduce((sum, one) => sum + one, 0),
    entry_speed: speeds[0]!,
    slowest: Math.min(...speeds),
    exit_speed: speeds.at(-1)!,
  };
}

/** A sector as shares of a lap that begins at a place, in one part or two. */
function partsOf({ length, isClosed }: Road, { start, end }: Sector, begin: number): [number, number][] {
  if (!isClosed) return [[Math.max(0, (start - begin) / length), Math.min(1, (end - begin) / length)]];
  const low = ((((start - begin) % length) + length) % length) / length;
  const high = low + (end - start) / length;
  if (high <= 1) return [[low, high]];
  return [
    [low, 1],
    [0, high - 1],
  ];
}

/** Boxes and other cars: an entry a row, or one where it stands. */
function thingsOf(rows: Float64Array[], columns: string[], { objectKinds, objectColumns }: Plan): LapTrace["objects"] {
  const { header, each } = objectColumns;
  const [kind, ...pose] = ["kind", "x", "y", "heading"].map((name) => each.indexOf(`object_${name}`));
  const found: LapTrace["objects"] = [];
  for (let at = columns.length + header.length; at < rows[0]!.length; at += each.length) {
    const name = objectKinds[rows[0]![at + kind!]!]!;
    if (name === "gone_racer") continue;
    const all = pose.map((column) => rows.map((row) => row[at + column]!));
    const isStill = all.every((values) => Math.max(...values) - Math.min(...values) < STILL);
    const [x, y, heading] = isStill ? all.map((values) => values.slice(0, 1)) : all;
    found.push({ kind: name, x: x!, y: y!, heading: heading! });
  }
  return found;
}
