/** By which rules models race, in which car and among what: what pages for new races, heats and ladders ask alike. */
import type { RuleSet } from "../api/races";
import type { components } from "../api/schema";
import type { Key } from "../i18n/en";
import { t } from "../i18n/index.svelte";
import type { AskedCar, AskedRanges } from "./conditions";
import { plain, withUnit } from "./numbers";

type Asked = components["schemas"]["NewHeat"];
type Lane = 1 | -1;

/** How boxes or bot cars are, where there are any. */
export interface Road {
  botSpeed: number; // m/s
  laneChanges: boolean;
  parkedCars: boolean;
  placement: "even" | "random" | "fixed";
  places: { at: number; lane: Lane }[]; // % of a lap
}

export type Ranking = NonNullable<Asked["ranking"]>;

/** Laps that a score takes, by what is ranked; a total takes all. */
export interface Needed {
  best: number;
  average: number;
}

export interface Terms {
  rules: Asked["rules"];
  offtrack_penalty: number; // s, as all that follow
  collision_penalty: number;
  max_resets: number;
  time_limit: number; // 0: none
  direction: Asked["direction"];
  vehicle: AskedCar;
  randomize: AskedRanges;
  seed: number | null; // none: drawn
}

export const RULES = ["drfc", "worker", "droa", "live"] as const;

export const newRoad = (placement: Road["placement"] = "even"): Road => ({
  botSpeed: 0.2,
  laneChanges: false,
  parkedCars: false,
  placement,
  places: [],
});

export const newTerms = (differing: Partial<Terms> = {}): Terms => ({
  ...{ rules: "drfc", offtrack_penalty: 5, collision_penalty: 5, max_resets: 100, time_limit: 0 },
  ...{ direction: "forward", vehicle: "v5", randomize: "none", seed: null },
  ...differing,
});

/** The same by another set of rules: its numbers, all of which can still be changed. */
export const byRules = (terms: Terms, { name, ...numbers }: RuleSet): Terms => ({
  ...terms,
  rules: name as Terms["rules"],
  offtrack_penalty: numbers.offtrack_penalty,
  collision_penalty: numbers.collision_penalty,
  max_resets: numbers.max_resets,
  time_limit: numbers.time_limit,
});

export const newNeeded = (): Needed => ({ best: 1, average: 3 });

/** What a request says of a ranking. */
export const askedRanking = (ranking: Ranking, needed: Needed, laps: number) => ({
  ranking,
  minimum_laps: ranking === "total" ? null : Math.min(needed[ranking], laps),
});

/** What places go by, in words. */
export function toldRanking(ranking: Ranking, needed: number): string {
  const name = t(`races_ranking_${ranking}`);
  if (ranking === "average") return `${name} (${t("races_in_a_row", { count: needed })})`;
  return ranking === "best" && needed > 1 ? `${name} (${t("races_at_least", { count: needed })})` : name;
}

/** What a request said of the road. */
export const roadOf = (
  asked: Pick<
    components["schemas"]["NewModel"],
    "bot_speed" | "lane_changes" | "parked_cars" | "placement" | "positions"
  >,
): Road => ({
  botSpeed: asked.bot_speed ?? 0.2,
  laneChanges: asked.lane_changes,
  parkedCars: asked.parked_cars,
  placement: asked.placement ?? "random",
  places: (asked.positions ?? []).map(([at, lane]) => ({ at: Math.round(1e6 * at) / 1e4, lane })),
});

/** Whether a kind of race has things on the road, and which. */
export const thingsOf = (kind: string): "boxes" | "bots" | undefined =>
  kind === "object-avoidance" || kind === "boxes"
    ? "boxes"
    : kind === "head-to-bot" || kind === "bots"
      ? "bots"
      : undefined;

/** What a request says of the road: only what its things have. */
export function askedRoad(road: Road, things: "boxes" | "bots" | undefined) {
  if (!things) return {};
  return {
    placement: road.placement,
    ...(road.placement === "fixed"
      ? { positions: road.places.map(({ at, lane }) => [at / 100, lane] as [number, Lane]) }
      : {}),
    ...(things === "bots"
      ? { bot_speed: road.botSpeed, lane_changes: road.laneChanges }
      : { parked_cars: road.parkedCars }),
  };
}

interface Group {
  count: number;
  placement: Road["placement"];
  positions: [number, number][];
  kind?: string;
  speed?: number;
  changes_lane?: boolean;
}

const placeOf = ([at, lane]: [number, number]) =>
  `${withUnit(Math.round(1000 * at) / 10, "%")} ${t(lane === 1 ? "road_inner" : "road_outer")}`;

/** What is on the road besides the models, in words. */
export function toldObjects(objects: Record<string, unknown>): string {
  const [obstacles, bots] = [objects["obstacles"], objects["bots"]] as (Group | null | undefined)[];
  const group = bots ?? obstacles;
  if (!group) return t("contests_road_none");
  const name: Key = bots ? "races_bots" : group.kind === "car" ? "road_parked_cars" : "races_objects";
  return [
    `${t(name)}: ${plain(group.count)}`,
    ...(bots ? [withUnit(group.speed, "m/s")] : []),
    ...(group.changes_lane ? [t("road_lanes_told")] : []),
    group.placement === "fixed" ? group.positions.map(placeOf).join(", ") : t(`road_${group.placement}`),
  ].join(" · ");
}

const cost = (value: unknown) => withUnit(Number(value), "s");

export const toldDirection = (rules: Record<string, unknown>): string =>
  t(rules["direction"] === "reverse" ? "reverse" : "forward");

/** The rules that something was driven under, as labels and values. */
export function toldRules(rules: Record<string, unknown>): [string, string][] {
  const mercy = Number(rules["mercy_after"]);
  return [
    [t("laps"), plain(Number(rules["laps"]))],
    [t("direction"), toldDirection(rules)],
    [t("races_offtrack_told"), cost(rules["offtrack_penalty"])],
    [t("races_collision_told"), cost(rules["collision_penalty"])],
    [t("races_resets"), plain(Number(rules["max_resets"]))],
    [t("terms_limit_told"), Number(rules["time_limit"]) ? cost(rules["time_limit"]) : t("terms_limit_none")],
    [t("terms_laps_flow"), t(rules["is_continuous"] ? "terms_flowing" : "terms_standing")],
    [t("terms_mercy"), mercy ? t("terms_mercy_after", { count: mercy }) : t("terms_mercy_never")],
  ];
}
