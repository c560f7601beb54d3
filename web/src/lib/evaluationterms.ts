/** What an evaluation has otherwise than its model learned it: a form's fields, what a request says, what a page tells. */
import type { components } from "../api/schema";
import { t } from "../i18n/index.svelte";
import { toldCar, toldRanges, type AskedCar, type AskedRanges } from "./conditions";
import { askedRoad, newRoad, newTerms, thingsOf, toldObjects, type Road, type Terms } from "./raceterms";

type Asked = components["schemas"]["EvaluateModel"];
type Held = components["schemas"]["EvaluationTerms"];

export interface Otherwise extends Pick<Terms, "offtrack_penalty" | "collision_penalty" | "max_resets"> {
  direction: "" | "forward" | "reverse"; // empty: as learned
  vehicle: AskedCar; // empty: as learned
  randomize: AskedRanges;
  race: "" | NonNullable<Asked["race"]>; // empty: as learned
  objects: number;
  road: Road;
}

export function newOtherwise(): Otherwise {
  const { offtrack_penalty, collision_penalty, max_resets } = newTerms();
  return {
    ...{ direction: "", vehicle: "", randomize: "none", race: "", objects: 6, road: newRoad() },
    ...{ offtrack_penalty, collision_penalty, max_resets },
  };
}

/** What a request says of it. */
export function askedOtherwise({ direction, vehicle, race, objects, road, ...rest }: Otherwise): Partial<Asked> {
  const things = race ? thingsOf(race) : undefined;
  return {
    ...rest,
    direction: direction || null,
    vehicle: vehicle || null,
    ...(race ? { race } : {}),
    ...(things ? { objects, ...askedRoad(road, things) } : {}),
  };
}

const isAmong = ({ objects }: Held) => Boolean(objects["obstacles"] ?? objects["bots"]);
const way = ({ rules }: Held) => t(rules["direction"] === "reverse" ? "reverse" : "forward");

/** In which car and under what it was driven, in a line. */
export const toldHeld = (held: Held): string =>
  [
    `${t("car")}: ${toldCar(held.vehicle)}`,
    `${t("direction")}: ${way(held)}`,
    ...(held.randomize === "none" ? [] : [`${t("evaluate_randomize")}: ${toldRanges(held.randomize as AskedRanges)}`]),
    ...(isAmong(held) ? [`${t("contests_road")}: ${toldObjects(held.objects)}`] : []),
  ].join(" · ");

/** What is not as usual, as short as a list wants it. */
export function marksOf(held: Held | null): string[] {
  if (!held) return [];
  return [
    ...(held.vehicle === "v5" ? [] : [typeof held.vehicle === "string" ? held.vehicle : t("car_own")]),
    ...(held.rules["direction"] === "reverse" ? [way(held)] : []),
    ...(held.randomize === "none"
      ? []
      : [typeof held.randomize === "string" ? toldRanges(held.randomize) : t("randomize_own")]),
  ];
}

/** Whether two were driven the same way round, as far as they tell. */
export const isSameWay = (one: Held | null, other: Held | null): boolean =>
  !one || !other || one.rules["direction"] === other.rules["direction"];
