/** Drive a replay again from its stored actions; every number must come out the same, bit for bit: racecraft.replay.verify.
 *
 *     file -> its conditions -> cars of the core, marshal <- its actions, step by step
 *                                   |
 *                                   v
 *                   rows, laps, rewards == those of the file ?   the first that differs ends it
 */
import type { Core, Settings } from "../core";
import { countOf, toldObjects } from "../objects";
import { arraysOf, doublesOf, type Plan, type TrackFile } from "../plan";
import { MOST_FILE, readReplay, type ReplayFile, type StoredCar } from "./file";
import { Marshal, type Course, type Driven } from "./marshal";
import { ReplayProblem } from "./problem";
import { provenanceOf, type Provenance } from "./provenance";
import { Road } from "../road";

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

const SMALLEST_CAMERA = 8; // pixels: only where the camera looks is part of the rules
const START_TOLERANCE = 1e-9; // m and rad, of a row that prepares a start
const MOST_STEPS_TO_A_LAP = 100_000;
const PALETTES = ["2018", "2020", "2026"];
const [FIXED, RANDOM] = [0, 2]; // starts of the simulation

export { ReplayProblem };

/** The same of a file that somebody chose, which is not read at all where it is too large. */
export async function verifyFile(
  core: Core,
  plan: Plan,
  file: Blob,
  track: (name: string) => Promise<TrackFile>,
): Promise<Verdict> {
  if (file.size > MOST_FILE) throw new ReplayProblem("replay_large", { size: MOST_FILE >> 20 });
  return verify(core, plan, new Uint8Array(await file.arrayBuffer()), track);
}

export async function verify(
  core: Core,
  plan: Plan,
  bytes: Uint8Array<ArrayBuffer>,
  track: (name: string) => Promise<TrackFile>,
): Promise<Verdict> {
  const columns = core.names("row");
  const replay = await readReplay(bytes, columns);
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
  return { ...about, difference: await differenceOf(core, plan, replay, road, columns) };
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

function settingsOf(plan: Plan, { rules, seed, camera, cars, cars_per_race }: ReplayFile, isClosed: boolean): Settings {
  const isAlone = cars_per_race === 1;
  const fromLine = rules.starts === "line";
  const laps = rules.is_continuous && isClosed ? rules.laps : 1; // of one simulated episode
  const told: Settings = {
    ...plan.races["time-trial"].trials,
    num_envs: cars.length,
    cars_per_race,
    seed: Number(seed & 0xffff_ffffn),
    seed_high: Number(seed >> 32n),
    laps,
    max_steps: laps * MOST_STEPS_TO_A_LAP,
    start_mode: fromLine ? FIXED : RANDOM,
    start_offset: fromLine ? rules.start_offset : 0,
    start_spread: 0,
    lateral_jitter: !fromLine && isAlone ? rules.lateral_jitter : 0,
    heading_jitter: !fromLine && isAlone ? rules.heading_jitter : 0,
    direction: rules.direction === "reverse" ? 1 : 0,
    has_camera: Number(camera !== null),
    palette: 0,
    picture_age: 0,
    baseline: 0,
  };
  if (!camera) return told;
  return {
    ...told,
    width: SMALLEST_CAMERA,
    height: SMALLEST_CAMERA,
    hfov: camera.horizontal_fov,
    forward: camera.forward,
    left: camera.left,
    above: camera.above_ground,
    pitch: camera.pitch,
    baseline: camera.baseline,
    palette: PALETTES.indexOf(camera.palette),
    picture_age: Math.round((camera.age / (1 / 15)) * plan.races["time-trial"].trials["substeps"]!),
  };
}

async function differenceOf(
  core: Core,
  plan: Plan,
  replay: ReplayFile,
  file: TrackFile,
  columns: string[],
): Promise<Difference | null> {
  const { rules, vehicle, objects, randomize, seed, cars: stored } = replay;
  const none = plan.known.randomize["none"]!;
  const isRandom = Object.entries(randomize).some(([name, [low, high]]) => {
    const range = none[name];
    if (!range) throw new ReplayProblem("replay_header", { at: "header.randomize" });
    return low !== range[0] || high !== range[1];
  });
  const ranges = isRandom ? Object.keys(none).flatMap((name) => randomize[name] ?? none[name]!) : undefined;
  const around = { objects: toldObjects(objects), ranges };
  const cars = core.track(arraysOf(file)).cars(settingsOf(plan, replay, file.told.isClosed), vehicle, around);
  const course: Course = {
    ...{ core, cars, rules, seed, columns, statuses: plan.statuses, numObjects: countOf(objects) },
    ...{ road: new Road(file, rules.direction === "reverse"), carsPerRace: replay.cars_per_race },
  };
  let found: Difference | undefined;
  const steps = stored.map(() => 0);
  const names = namesOf(columns, cars.rowWidth);
  const compare = (car: number, driven: Float64Array) => {
    const step = steps[car]!++;
    if (found && found.car <= car) return; // of cars that differ in one step, the first is named
    found = rowDifference(stored[car]!, driven, { car, step, names, columns, statuses: plan.statuses }) ?? found;
  };
  const marshal = await Marshal.begin(course, isRandom, compare);
  const actions = new Float32Array(2 * stored.length);
  while (!found && marshal.isRacing) {
    actions.fill(0);
    stored.forEach((car, index) => {
      const step = steps[index]!;
      if (step < car.steps) actions.set(car.actions.subarray(2 * step, 2 * step + 2), 2 * index);
    });
    marshal.step(actions);
  }
  if (found) return found;
  const results = marshal.results();
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
