/** What stands or drives on the track besides the car, as racecraft.sim.Objects, and as the core is told. */
import type { Around } from "./core";
import type { Objects } from "./verify/header";

const PLACEMENTS = ["even", "random", "fixed"];
const KINDS = { box: 0, car: 1 } as Record<string, number>; // places in racecraft.sim.objects.OBJECT_KINDS

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
