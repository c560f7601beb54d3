/** Races that models are entered in. */
import { ask } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];
export type RaceCard = Schemas["RaceCard"];
export type RaceDetail = Schemas["RaceDetail"];
export type RaceReplay = Schemas["RaceReplay"];
export type Standing = Schemas["Standing"];
export type RuleSet = Schemas["RuleSet"];
export type CheckpointChoice = NonNullable<Schemas["Enter"]["checkpoint"]>;
export type Starter = Required<Schemas["Starter"]>;
export type Ghost = Starter | Schemas["Evaluated"] | Required<Schemas["EarlierHeat"]> | "best-lap";
export type NewRace = Partial<Schemas["NewRace"]> & { title: string };

export const raceApi = {
  list: () => ask<RaceCard[]>("GET", "/races"),
  get: (id: number) => ask<RaceDetail>("GET", `/races/${id}`),
  create: (race: NewRace) => ask<RaceDetail>("POST", "/races", race),
  change: (id: number, change: Partial<Schemas["RaceChange"]>) => ask<RaceDetail>("PATCH", `/races/${id}`, change),
  remove: (id: number) => ask<void>("DELETE", `/races/${id}`),
  restore: (id: number) => ask<RaceDetail>("POST", `/races/${id}/restore`),
  rules: () => ask<RuleSet[]>("GET", "/races/rules"),
  enter: (id: number, entered: { models: string[]; checkpoint: CheckpointChoice; ghosts: Ghost[] }) =>
    ask<RaceDetail>("POST", `/races/${id}/entries`, entered),
  withdraw: (id: number, entry: number) => ask<void>("DELETE", `/races/${id}/entries/${entry}`),
  replay: (id: number, entries: number[]) => ask<RaceReplay>("GET", `/races/${id}/replay?entries=${entries.join(",")}`),
};
