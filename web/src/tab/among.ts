/** Rows of a car among what stands and drives on the road, and the moments that a reward is tried in there:
 * racecraft.reward.dry_run. */
import type { Core, Settings } from "./core";
import { momentOn } from "./moments";
import { toldObjects } from "./objects";
import { arraysOf, type Plan, type TrackFile } from "./plan";
import type { Objects } from "./verify/header";

type Moments = TrackFile["situations"];

/** What of a plan says how objects are put on a road, and which. */
export interface Among {
  objects: Objects;
  trials: Settings;
  vehicle: Settings;
  statuses: string[];
  objectColumns: Plan["objectColumns"];
}

const HALF_VIEW = Math.PI / 3; // rad of the camera, to each side
const NEAR = 0.6; // m from an object's middle to the point that x and y mean
const DIRECTIONS = [0, 1]; // forward, reversed

/** What an object's row says, by its name. */
type Thing = Record<string, number>;

/** What is on a road at the beginning of an episode, in a direction, and rows of a car among it; undefined where nothing
 * is there besides. */
export function thingsOn(core: Core, track: TrackFile, about: Among) {
  const told = toldObjects(about.objects);
  if (!told) return undefined;
  const columns = core.names("row");
  const at = Object.fromEntries(columns.map((name, index) => [name, index]));
  const { header, each } = about.objectColumns;

  function placed(direction: number): Thing[] {
    const road = core.track(arraysOf(track));
    const once = { num_envs: 1, seed: 0, seed_high: 0, start_offset: 0, direction, has_camera: 0, has_lidar: 0 };
    const cars = road.cars({ ...about.trials, ...once }, about.vehicle, { objects: told! });
    road.free();
    const row = cars.rows.slice(columns.length + header.length);
    cars.free();
    return Array.from({ length: row.length / each.length }, (_, index) =>
      Object.fromEntries(each.map((name, place) => [name, row[index * each.length + place]!])),
    );
  }

  function among(row: ArrayLike<number>, things: Thing[]): number[] {
    const value = (name: string) => row[at[name]!]!;
    const length = value("track_length");
    const ahead = things.map((one) => modulo(one["object_distance"]! - value("projection_distance"), length));
    const away = things.map((one) => [one["object_x"]! - value("x"), one["object_y"]! - value("y")] as const);
    const isSeen = away.some(([x, y]) => Math.cos(Math.atan2(y, x) - value("heading")) > Math.cos(HALF_VIEW));
    const hit = first(
      away.map(([x, y]) => Math.hypot(x, y)),
      (a, b) => a < b,
    );
    const heads: Record<string, number> = {
      closest_object_prev: first(ahead, (a, b) => a > b),
      closest_object_next: first(ahead, (a, b) => a < b),
      object_in_camera: Number(isSeen),
      crashed_object: value("is_crashed") ? hit : -1,
    };
    const numbers = things.flatMap((one) => each.map((name) => one[name]!));
    return [...Array.from(row), ...header.map((name) => heads[name]!), ...numbers];
  }

  return { placed, among };
}

/** The same moments among objects, where there are any, and two more beside one of them. */
export function momentsAmong(core: Core, track: TrackFile, about: Among): Moments {
  const found = thingsOn(core, track, about);
  if (!found) return track.situations;
  const { placed, among } = found;
  const columns = core.names("row");
  const at = Object.fromEntries(columns.map((name, index) => [name, index]));

  /** Moments that only a road with objects has, at the one that is nearest to half a lap. */
  function beside(things: Thing[]): Moments {
    const on = momentOn(track, false, { columns, statuses: about.statuses });
    const length = on(0)[at["track_length"]!]!;
    const nearest = first(
      things.map((one) => Math.abs(one["object_distance"]! - length / 2)),
      (a, b) => a < b,
    );
    const [place, offset] = [things[nearest]!["object_distance"]!, things[nearest]!["object_offset"]!];
    const moments: [string, Float64Array][] = [
      ["near an object", on(place - NEAR, { steps: 110, offset })],
      ["crash", on(place - NEAR / 2, { steps: 112, offset, status: "crashed" })],
    ];
    return moments.map(([name, row]) => ({ name, description: name, row: among(row, things) }));
  }

  const sides = DIRECTIONS.map(placed);
  const moments = track.situations.map((one) => ({
    ...one,
    row: among(one.row, sides[one.row[at["track_index"]!]!]!),
  }));
  return [...moments.slice(0, -1), ...beside(sides[0]!), moments.at(-1)!];
}

const modulo = (value: number, length: number) => ((value % length) + length) % length;

/** Where the first of the best is. */
const first = (values: number[], isBetter: (a: number, b: number) => boolean): number =>
  values.reduce((best, value, index) => (isBetter(value, values[best]!) ? index : best), 0);
