import { ask, type JobInfo, type ModelCard } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];
export type TunableNumber = Schemas["TunableNumber"];
export type TuningCard = Schemas["TuningCard"];
export type TuningTrial = Schemas["TuningTrial"];
export type NewTuning = Partial<Schemas["NewTuning"]>;

const at = (run: string) => `/models/${encodeURIComponent(run)}/tunings`;

export const tunings = {
  list: (run: string) => ask<TuningCard[]>("GET", at(run)),
  space: (run: string) => ask<TunableNumber[]>("GET", `${at(run)}/space`),
  start: (run: string, request: NewTuning) => ask<JobInfo>("POST", at(run), request),
  stop: (job: string) => ask<JobInfo>("POST", `/jobs/${job}/cancel`),
  keep: (run: string, tuning: string, trial: number) => ask<ModelCard>("POST", `${at(run)}/${tuning}/keep`, { trial }),
  remove: (run: string, tuning: string) => ask<void>("DELETE", `${at(run)}/${tuning}`),
};
