/** The header of a replay file, field by field: what a stranger's file may say, as racecraft.replay.header. */
import { ReplayProblem } from "./problem";

type Json = Record<string, unknown>;

export interface Lap {
  number: number;
  status: string;
  start_time: number;
  time: number;
  completion: number;
  off_track_count: number;
  crash_count: number;
  immobilized_count: number;
  reversed_count: number;
  resets: number;
  penalty_seconds: number;
}

export interface CarHeader {
  name: string;
  steps: number;
  status: string;
  completion: number;
  laps: Lap[];
  types: ColumnType[];
}

export interface Rules {
  laps: number;
  is_continuous: boolean;
  max_resets: number;
  offtrack_penalty: number;
  collision_penalty: number;
  immobilized_penalty: number;
  mercy_after: number;
  time_limit: number;
  starts: string;
  start_offset: number;
  direction: string;
  lateral_jitter: number;
  heading_jitter: number;
}

export interface Group {
  count: number;
  placement: string;
  positions: [number, number][];
  min_distance: number;
}
export type Obstacles = Group & { kind: string };
export type Bots = Group & {
  speed: number;
  changes_lane: boolean;
  shortest_stay: number;
  longest_stay: number;
  change_distance: number;
};

export interface Objects {
  obstacles: Obstacles | null;
  bots: Bots | null;
}

export interface Camera {
  width: number;
  height: number;
  horizontal_fov: number;
  forward: number;
  left: number;
  above_ground: number;
  pitch: number;
  baseline: number;
  age: number;
  palette: string;
}

export interface Header {
  title: string;
  racecraft: string;
  track: { name: string; waypoints: number; repeats: number[]; types: ColumnType[] };
  seed: bigint;
  rules: Rules;
  vehicle: Record<string, number>;
  camera: Camera | null;
  objects: Objects;
  randomize: Record<string, [number, number]>;
  cars_per_race: number;
  race: { commitment: string } | null;
  cars: CarHeader[];
}

export const WIDTHS = { u1: 1, i2: 2, i4: 4, f4: 4, f8: 8 } as const; // bytes of a number
export type ColumnType = keyof typeof WIDTHS;

const [MOST_CARS, MOST_LAPS, MOST_STEPS, MOST_WAYPOINTS, MOST_OBJECTS] = [1000, 100_000, 10_000_000, 65_535, 32];

/** A check of a value at a place in the header, which gives it back. */
type Check<T> = (value: unknown, at: string) => T;

const wrong = (at: string): never => {
  throw new ReplayProblem("replay_header", { at: at.slice(0, 100) });
};

const number =
  (low: number, high: number): Check<number> =>
  (value, at) =>
    typeof value === "number" && value >= low && value <= high ? value : wrong(at);
const whole =
  (low: number, high: number): Check<number> =>
  (value, at) =>
    Number.isSafeInteger(number(low, high)(value, at)) ? (value as number) : wrong(at);
const flag: Check<boolean> = (value, at) => (typeof value === "boolean" ? value : wrong(at));
const name: Check<string> = (value, at) => (typeof value === "string" && value.length <= 200 ? value : wrong(at));
const one =
  <T extends string>(...allowed: T[]): Check<T> =>
  (value, at) =>
    allowed.includes(value as T) ? (value as T) : wrong(at);
const list =
  <T>(check: Check<T>, most: number, least = 0): Check<T[]> =>
  (value, at) =>
    Array.isArray(value) && value.length >= least && value.length <= most
      ? value.map((item, index) => check(item, `${at}.${index}`))
      : wrong(at);
const maybe =
  <T>(check: Check<T>): Check<T | null> =>
  (value, at) =>
    value === null ? null : check(value, at);
const pair =
  (first: Check<number>, second = first): Check<[number, number]> =>
  (value, at) =>
    Array.isArray(value) && value.length === 2 ? [first(value[0], at), second(value[1], at)] : wrong(at);

/** An object with exactly these fields. */
const fields =
  <T>(checks: { [K in keyof T]: Check<T[K]> }): Check<T> =>
  (value, at) => {
    if (typeof value !== "object" || value === null || Array.isArray(value)) return wrong(at);
    for (const key of Object.keys(value)) if (!Object.hasOwn(checks, key)) wrong(`${at}.${key}`);
    const entries = Object.entries(checks) as [string, Check<unknown>][];
    return Object.fromEntries(entries.map(([key, check]) => [key, check((value as Json)[key], `${at}.${key}`)])) as T;
  };
/** An object of any names. */
const named =
  <T>(check: Check<T>): Check<Record<string, T>> =>
  (value, at) =>
    typeof value === "object" && value !== null && !Array.isArray(value)
      ? Object.fromEntries(Object.entries(value).map(([key, item]) => [key, check(item, `${at}.${key}`)]))
      : wrong(at);

const type = one(...(Object.keys(WIDTHS) as ColumnType[]));
const count = whole(0, Number.MAX_SAFE_INTEGER);
const seconds = number(0, 1e9);
const penalty = number(0, 600);
const group = {
  count: whole(1, MOST_OBJECTS),
  placement: one<string>("even", "random", "fixed"),
  positions: list(
    pair(number(0, 1), (value, at) => (value === 1 || value === -1 ? value : wrong(at))),
    1000,
  ),
  min_distance: number(0, 1000),
};

const shapes = fields<Objects>({
  obstacles: maybe(fields<Obstacles>({ ...group, kind: one<string>("box", "car") })),
  bots: maybe(
    fields<Bots>({
      ...group,
      speed: number(0, 10),
      changes_lane: flag,
      shortest_stay: number(0.1, 3600),
      longest_stay: number(0.1, 3600),
      change_distance: number(0.1, 100),
    }),
  ),
});

/** What is around a car: of places that are fixed, one for each. */
export const around: Check<Objects> = (value, at) => {
  const found = shapes(value, at);
  for (const [kind, group] of Object.entries(found) as [string, Group | null][])
    if (group?.placement === "fixed" && group.positions.length < group.count) wrong(`${at}.${kind}.positions`);
  return found;
};

const header = fields<Header>({
  title: name,
  racecraft: name,
  track: fields({
    name,
    waypoints: whole(2, MOST_WAYPOINTS),
    repeats: list(count, 1000),
    types: list(type, 6, 6),
  }),
  seed: (value, at) => {
    const seed = typeof value === "string" && /^\d{1,20}$/.test(value) ? BigInt(value) : wrong(at);
    return seed < 1n << 64n ? seed : wrong(at);
  },
  rules: fields<Rules>({
    laps: whole(1, 1000),
    is_continuous: flag,
    max_resets: whole(0, 1_000_000),
    offtrack_penalty: penalty,
    collision_penalty: penalty,
    immobilized_penalty: penalty,
    mercy_after: whole(0, 1_000_000),
    time_limit: number(0, 86_400),
    starts: one<string>("line", "lap"),
    start_offset: number(0, 0.999999),
    direction: one<string>("forward", "reverse"),
    lateral_jitter: number(0, 1),
    heading_jitter: number(0, Math.PI),
  }),
  vehicle: named(number(-1e6, 1e6)),
  camera: maybe(
    fields<Camera>({
      width: whole(8, 2048),
      height: whole(8, 2048),
      horizontal_fov: number(0.1, 2.8),
      forward: number(-2, 2),
      left: number(-2, 2),
      above_ground: number(0.02, 0.9),
      pitch: number(0, 1.5),
      baseline: number(0, 0.5),
      age: number(0, 1 / 15),
      palette: one<string>("2018", "2020", "2026"),
    }),
  ),
  objects: around,
  randomize: named(pair(number(-10, 10))),
  cars_per_race: whole(1, 8),
  race: maybe((value, at) => {
    const { commitment } = named((item) => item)(value, at);
    return { commitment: name(commitment, `${at}.commitment`) };
  }),
  cars: list(
    fields<CarHeader>({
      name,
      steps: whole(1, MOST_STEPS),
      status: name,
      completion: number(0, 1),
      laps: list(
        fields<Lap>({
          number: whole(1, MOST_LAPS),
          status: name,
          start_time: seconds,
          time: seconds,
          completion: number(0, 1),
          off_track_count: count,
          crash_count: count,
          immobilized_count: count,
          reversed_count: count,
          resets: count,
          penalty_seconds: seconds,
        }),
        MOST_LAPS,
      ),
      types: list(type, 1000),
    }),
    MOST_CARS,
    1,
  ),
});

// A quote in a string of JSON's is escaped, so this is never inside of one.
const SEED = /([{,]\s*"seed"\s*:\s*)(\d{1,20})(?=\s*[,}])/g;

/** The header of a file's text. A seed has up to 64 bits, more than a number of JavaScript's. */
export function headerOf(text: string): Header {
  let document: Json;
  try {
    document = JSON.parse(text.replaceAll(SEED, '$1"$2"')) as Json;
  } catch {
    return wrong("JSON");
  }
  return header({ race: null, ...document }, "header");
}
