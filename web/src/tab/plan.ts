/** What the page is told of the training that it runs: the files that `python -m racecraft.site` writes beside it. */
import type { ActionPreset, MedalTimes, TrackGeometry } from "../api/client";
import type { NetworkSettings, Settings, TrackArrays } from "./core";
import type { Objects } from "./verify/header";
import type { Known } from "./verify/provenance";

export interface RewardPreset {
  name: string;
  description: string;
  source: string;
  seesObjects: boolean; // and means nothing without them
}

export type RaceType = "time-trial" | "object-avoidance" | "head-to-bot";

/** What of a training depends on the kind of race. */
export interface RacePlan {
  reward: string; // that it begins with
  space: string; // likewise
  objects: Objects; // likewise
  laps: number; // of an evaluation, until it ends
  good: number; // mean completion from which on the averaged weights drive
  evaluateEvery: number; // camera steps
  cars: Settings;
  trials: Settings;
  policies: { default: Policy; continuous: Policy };
}

/** What of a training depends on the actions. */
export interface Policy {
  network: NetworkSettings;
  layers: number[][]; // rows, columns, gain of every matrix
  weights: [string, number[]][]; // name and shape of every array, in the order of a flat vector
  logStd: number; // that continuous actions begin with
  ppo: Settings;
  table: number[]; // (A, 2) steering angle in rad, speed in m/s; or the lowest and the highest (2, 2)
  run: Record<string, unknown>; // run.json, but for seed, track and time
  modelMetadata: Record<string, unknown>;
  spec: Record<string, unknown>;
}

export interface Plan {
  vehicle: Settings;
  averageShare: number;
  slowest: number; // m/s
  evaluationSeed: number; // added to a training's
  seeds: number[];
  columns: string[]; // of a row
  statuses: string[]; // of a car, by the number in its row
  traceWidth: number; // numbers that the installed program logs of a step
  objectKinds: string[]; // by the number in a row
  objectColumns: { header: string[]; each: string[] }; // behind a row's own
  spaces: ActionPreset[]; // the default first
  races: Record<RaceType, RacePlan>;
  starter: { table: number[] }; // lowest and highest command of the car that drives at first (2, 2)
  known: Known; // rules, cars and randomisations of the library
  replays: ReplayLimits;
  tracks: string[];
  titles: Record<string, string>; // of those of the library
  medals: Record<string, MedalTimes | null>; // by track of the library; none where no limit is known
  rewards: RewardPreset[];
}

/** How large a replay may be, as for racecraft.replay: bytes of the file, of what is packed in it and of its header; bytes
 * that a body may have in any file and for each byte of it; numbers in all rows, and the largest of them. */
export type ReplayLimits = Record<"file" | "body" | "header" | "dense" | "density" | "cells" | "number", number>;

interface Packed {
  dtype: "float64" | "float32" | "int32";
  data: string; // base64
}

export interface TrackFile {
  told: {
    lines: Packed;
    tables: Packed;
    waypoints: Packed;
    count: number;
    samplesPerMetre: number;
    isClosed: boolean;
  };
  waypoints: [number, number][][]; // (2, K, 2) m: forward, reversed
  road: { arcs: Packed; headings: Packed; innerIsLeft: boolean[]; repeats: number[] }; // of both directions
  geometry: TrackGeometry;
  digest: string;
  situations: { name: string; description: string; row: number[] }[]; // that a reward of one's own is tried in
}

/** Numbers that crossed as text. */
export const doublesOf = (packed: Packed): Float64Array => new Float64Array(bytesOf(packed));

const bytesOf = ({ data }: Packed) => Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)).buffer;

export const arraysOf = ({ told }: TrackFile): TrackArrays => ({
  ...told,
  lines: doublesOf(told.lines),
  tables: new Float32Array(bytesOf(told.tables)),
  waypoints: new Int32Array(bytesOf(told.waypoints)),
});

/** Of every piece of the centre line, the waypoint where it begins  (W - 1,). */
export const indicesOf = ({ told }: TrackFile, isReversed = false): Int32Array => {
  const pieces = told.count - 1;
  return new Int32Array(bytesOf(told.waypoints)).subarray(isReversed ? pieces : 0, isReversed ? 2 * pieces : pieces);
};

export const readTrack = async (site: string, name: string): Promise<TrackFile> =>
  (await (await read(site, `data/tracks/${name.replace(":", "-")}.json`)).json()) as TrackFile;

/** What a track is called, as in the console; one that was drawn has its name alone. */
export const titleOf = ({ titles }: Pick<Plan, "titles">, name: string): string =>
  Object.hasOwn(titles, name) ? titles[name]! : name.replaceAll(/[_:]/g, " ");

/** A file of the site, wherever the site lies. */
export async function read(site: string, file: string): Promise<Response> {
  const answer = await fetch(new URL(file, site));
  if (!answer.ok) throw new Error(`${file} of this site cannot be read (${answer.status}).`);
  return answer;
}
