/** Models against models: heats on one road, and ladders. */
import { ask } from "./client";
import type { Ghost, RaceReplay, Starter } from "./races";
import type { components } from "./schema";

type Schemas = components["schemas"];
export type ContestCard = Schemas["ContestCard"];
export type ContestDetail = Schemas["ContestDetail"];
export type LadderMatch = Schemas["LadderMatch"];
export type { Ghost, Starter };
export type EvaluatedCard = Schemas["EvaluatedCard"];
export type Direction = NonNullable<Schemas["NewHeat"]["direction"]>;
export type NewHeat = Partial<Schemas["NewHeat"]> & { models: Starter[] };
export type NewLadder = Partial<Schemas["NewLadder"]> & { models: Starter[]; tracks: string[] };

export const contestApi = {
  list: () => ask<ContestCard[]>("GET", "/contests"),
  evaluated: (track: string, direction: Direction) =>
    ask<EvaluatedCard[]>("GET", `/contests/ghosts?track=${encodeURIComponent(track)}&direction=${direction}`),
  get: (id: string) => ask<ContestDetail>("GET", `/contests/${id}`),
  heat: (heat: NewHeat) => ask<ContestDetail>("POST", "/contests/heats", heat),
  ladder: (ladder: NewLadder) => ask<ContestDetail>("POST", "/contests/ladders", ladder),
  stop: (id: string) => ask<unknown>("POST", `/jobs/${id}/cancel`),
  remove: (id: string) => ask<void>("DELETE", `/contests/${id}`),
  replay: (id: string, match?: number) =>
    ask<RaceReplay>("GET", `/contests/${id}/replay${match === undefined ? "" : `?match=${match}`}`),
};

export const isUnderWay = (contest: { state: string }) => contest.state === "queued" || contest.state === "running";
