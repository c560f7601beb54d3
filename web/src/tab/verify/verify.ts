/** Drive a replay again from its stored actions; every number must come out the same, bit for bit: racecraft.replay.verify.
 *
 *     file -> its conditions -> cars of the core, marshal <- its actions, step by step
 *                                   |
 *                                   v
 *                   rows, laps, rewards == those of the file ?   the first that differs ends it
 */
import type { Core } from "../core";
import { doublesOf, type Plan, type TrackFile } from "../plan";
import { driveAgain } from "./again";
import { readReplay, tooLarge, type ReplayFile, type StoredCar } from "./file";
import type { Driven } from "./marshal";
import { ReplayProblem } from "./problem";
import { provenanceOf, type Provenance } from "./provenance";

/** The first thing that comes out otherwise. */
export interface Difference {
  car: number; // from 0
  step: number; // of that car's recording, from 0
  what: string; // a column, or reward, action, length, lap, result
  stored: string;
  driven: string;
}

export interface Verdict {
  title: string;
  track: string;
  writtenBy: string;
  race: string | null; // commitment of the race that it says it is of
  steps: number; // of all cars
  cars: { name: string; laps: number; best: number | null; time: number }[];
  difference: Difference | null;
  driven: Provenance;
}

const START_TOLERANCE = 1e-9; // m and rad, of a row that prepares a start

export { ReplayProblem };

/** The same of a file that somebody chose, which is not read at all where it is too large. */
export async function verifyFile(
  core: Core,
  plan: Plan,
  file: Blob,
  track: (name: string) => Promise<TrackFile>,
  keep?: (replay: ReplayFile, road: TrackFile) => void,
): Promise<Verdict> {
  if (file.size > plan.replays.file) throw tooLarge(plan.replays);
  return verify(core, plan, new Uint8Array(await file.arrayBuffer()), track, keep);
}

/** `keep` is told what a genuine file holds. */
export async function verify(
  core: Core,
  plan: Plan,
  bytes: Uint8Array<ArrayBuffer>,
  track: (name: string) => Promise<TrackFile>,
  keep: (replay: ReplayFile, road: TrackFile) => void = () => undefined,
): Promise<Verdict> {
  const columns = core.names("row");
  const replay = await readReplay(bytes, columns, plan.replays);
  const road = await roadOf(replay, plan, track);
  const about = {
    title: printable(replay.title),
    track: replay.track.name,
    writtenBy: printable(replay.racecraft),
    race: replay.race?.commitment ?? null,
    steps: replay.cars.reduce((sum, { steps }) => sum + steps, 0),
    cars: replay.cars.map(({ name, laps }) => {
      const times = laps.filter(({ status }) => status === "lap_complete").map(({ time }) => time);
      const time = laps.reduce((sum, lap) => sum + lap.time, 0);
      return { name: printable(name), laps: times.length, best: times.length ? Math.min(...times) : null, time };
    }),
    driven: provenanceOf(replay, plan.known),
  };
  const difference = await differenceOf(core, plan, replay, road, columns);
  if (!difference) keep(replay, road);
  return { ...about, difference };
}

/** Somebody else's words, without what is no letter. */
const printable = (words: string) => words.replaceAll(/\p{C}/gu, "�");

/** The file of the track that was driven, which must be one of the library, to the bit. */
async function roadOf(
  { track, lines }: ReplayFile,
  plan: Plan,
  read: (name: string) => Promise<TrackFile>,
): Promise<TrackFile> {
  const problem = (key: "replay_track" | "replay_road") =>
    new ReplayProblem(key, { name: printable(track.name).slice(0, 60) });
  if (!plan.tracks.includes(track.name)) throw problem("replay_track");
  const file = await read(track.name);
  const { count } = file.told;
  const known = doublesOf(file.told.lines);
  const isSame =
    count === track.waypoints &&
    file.road.repeats.join() === track.repeats.join() &&
    lines.every((value, at) => {
      const [column, row] = [Math.floor(at / count), at % count];
      return Object.is(value, known[Math.floor(column / 2) * 2 * count + 2 * row + (column % 2)]);
    });
  if (!isSame) throw problem("replay_road");
  return file;
}

async function differenceOf(
  core: Core,
  plan: Plan,
  replay: ReplayFile,
  file: TrackFile,
  columns: string[],
): Promise<Difference | null> {
  const stored = replay.cars;
  let found: Difference | undefined;
  let names: string[] | undefined;
  const steps = stored.map(() => 0);
  const compare = (car: number, driven: Float64Array) => {
    const step = steps[car]!++;
    if (found && found.car <= car) return; // of cars that differ in one step, the first is named
    names ??= namesOf(columns, driven.length);
    found = rowDifference(stored[car]!, driven, { car, step, names, columns, statuses: plan.statuses }) ?? found;
  };
  const results = await driveAgain(core, plan, replay, file, { log: compare, isOver: () => found !== undefined });
  if (found) return found;
  for (const [car, driven] of results.entries()) {
    const other = resultDifference(stored[car]!, driven, { car, steps: steps[car]!, columns, statuses: plan.statuses });
    if (other) return other;
  }
  return null;
}

/** Names of a row's columns, those of objects included. */
function namesOf(columns: string[], width: number): string[] {
  if (width === columns.length) return columns;
  const header = ["closest_object_prev", "closest_object_next", "object_in_camera", "crashed_object"];
  const each = ["kind", "x", "y", "heading", "speed", "offset", "distance"];
  const things = (width - columns.length - header.length) / each.length;
  const named = Array.from({ length: things }, (_, thing) => each.map((name) => `object_${name} of object ${thing}`));
  return [...columns, ...header, ...named.flat()];
}

function rowDifference(
  stored: StoredCar,
  driven: Float64Array,
  on: { car: number; step: number; names: string[]; columns: string[]; statuses: string[] },
): Difference | undefined {
  const { car, step, names, columns, statuses } = on;
  const row = stored.rows[step];
  if (!row) return { car, step, what: "length", stored: String(stored.steps), driven: `> ${stored.steps}` };
  const [status, prepare] = [columns.indexOf("status"), statuses.indexOf("prepare")];
  const isStart = row[status] === prepare && driven[status] === prepare;
  const differs = isStart
    ? (value: number, at: number) => !(Math.abs(value - driven[at]!) <= START_TOLERANCE)
    : (value: number, at: number) => !Object.is(value, driven[at]);
  const at = row.findIndex(differs);
  if (at < 0) return undefined;
  return { car, step, what: names[at]!, stored: String(row[at]), driven: String(driven[at]) };
}

function resultDifference(
  stored: StoredCar,
  driven: Driven,
  on: { car: number; steps: number; columns: string[]; statuses: string[] },
): Difference | undefined {
  const { car, steps, columns, statuses } = on;
  const differs = (step: number, what: string, theirs: unknown, ours: unknown): Difference => ({
    ...{ car, step, what },
    stored: typeof theirs === "object" ? JSON.stringify(theirs) : String(theirs),
    driven: typeof ours === "object" ? JSON.stringify(ours) : String(ours),
  });
  if (stored.steps !== steps) return differs(steps, "length", stored.steps, steps);
  const [status, offset, width] = ["status", "offset", "track_width"].map((name) => columns.indexOf(name));
  for (const [step, row] of stored.rows.entries()) {
    const isStanding = ["prepare", "pause", "park"].includes(statuses[row[status!]!]!);
    const paid = isStanding ? 0 : centerlineReward(Math.abs(row[offset!]!) / row[width!]!);
    if (!Object.is(stored.rewards[step], paid)) return differs(step, "reward", stored.rewards[step], paid);
  }
  for (const [step, row] of stored.rows.entries()) {
    if (statuses[row[status!]!] !== "prepare") continue; // nobody is asked for an action there
    const asked = [...stored.actions.subarray(2 * step, 2 * step + 2)];
    if (asked.some((value) => value !== 0)) return differs(step, "action", asked, [0, 0]);
  }
  for (let number = 0; number < Math.max(stored.laps.length, driven.laps.length); number++) {
    const [theirs, ours] = [stored.laps[number], driven.laps[number]];
    const names = Object.keys(theirs ?? ours!) as (keyof typeof ours)[];
    if (!theirs || !ours || names.some((name) => !Object.is(theirs[name], ours[name])))
      return differs(steps - 1, "lap", theirs ?? null, ours ?? null);
  }
  if (stored.status !== driven.status) return differs(steps - 1, "result", stored.status, driven.status);
  if (!Object.is(stored.completion, driven.completion))
    return differs(steps - 1, "result", stored.completion, driven.completion);
  return undefined;
}

/** AWS's default reward, which evaluations log. */
const centerlineReward = (share: number) => (share <= 0.1 ? 1 : share <= 0.25 ? 0.5 : share <= 0.5 ? 0.1 : 0.001);
