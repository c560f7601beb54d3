/** What stands or drives on the track besides the car, as racecraft.sim.Objects, and as the core is told. */
import type { Around } from "./core";
import type { Plan } from "./plan";
import type { Objects } from "./verify/header";

const PLACEMENTS = ["even", "random", "fixed"];
const KINDS = { box: 0, car: 1 } as Record<string, number>; // places in racecraft.sim.objects.OBJECT_KINDS

const [MOST, FASTEST] = [32, 4]; // objects of a race, m/s of a bot
const GONE = "gone_racer";

/** What is around a car, of its row: kind, x, y, heading in mm and mrad, as the console's server tells it. */
export function objectsOf(
  row: Float64Array,
  numColumns: number,
  { objectKinds, objectColumns: { header, each } }: Plan,
): [string, number, number, number][] {
  const found: [string, number, number, number][] = [];
  const [kind, x, y, heading] = ["kind", "x", "y", "heading"].map((name) => each.indexOf(`object_${name}`));
  const milli = (value: number) => Math.round(1000 * value);
  for (let at = numColumns + header.length; at < row.length; at += each.length) {
    const name = objectKinds[row[at + kind!]!]!;
    if (name !== GONE) found.push([name, milli(row[at + x!]!), milli(row[at + y!]!), milli(row[at + heading!]!)]);
  }
  return found;
}

/** A race's objects with what somebody chose of them, within what a track takes. */
export function objectsFor(
  { obstacles, bots }: Objects,
  { count, speed, changesLane }: { count: number; speed: number; changesLane: boolean },
): Objects {
  const within = (value: number, low: number, high: number) => Math.min(Math.max(value || low, low), high);
  const many = Math.round(within(count, 1, MOST));
  return {
    obstacles: obstacles && { ...obstacles, count: many },
    bots: bots && { ...bots, count: many, speed: within(speed, 0, FASTEST), changes_lane: changesLane },
  };
}

export const countOf = ({ obstacles, bots }: Objects): number => (obstacles?.count ?? 0) + (bots?.count ?? 0);

/** Nothing where there are no objects. */
export function toldObjects({ obstacles, bots }: Objects): NonNullable<Around["objects"]> | undefined {
  if (!obstacles && !bots) return undefined;
  const places = [obstacles, bots].flatMap((group) =>
    group?.placement === "fixed" ? group.positions.slice(0, group.count) : [],
  );
  return {
    settings: {
      obstacle_kind: KINDS[obstacles?.kind ?? "box"]!,
      obstacle_count: obstacles?.count ?? 0,
      obstacle_placement: PLACEMENTS.indexOf(obstacles?.placement ?? "even"),
      obstacle_distance: obstacles?.min_distance ?? 2,
      bot_count: bots?.count ?? 0,
      bot_placement: PLACEMENTS.indexOf(bots?.placement ?? "even"),
      bot_distance: bots?.min_distance ?? 2,
      bot_speed: bots?.speed ?? 0.2,
      changes_lane: Number(bots?.changes_lane ?? false),
      shortest_stay: bots?.shortest_stay ?? 3,
      longest_stay: bots?.longest_stay ?? 5,
      change_distance: bots?.change_distance ?? 1,
    },
    places,
  };
}
