/** Sweeps: settings by seeds. */
import { ask } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];
export type SweepCard = Schemas["SweepCard"];
export type SweepDetail = Schemas["SweepDetail"];
export type SweepFigure = Schemas["SweepFigure"];

const at = (name: string) => `/sweeps/${encodeURIComponent(name)}`;

export const sweepApi = {
  list: () => ask<SweepCard[]>("GET", "/sweeps"),
  get: (name: string) => ask<SweepDetail>("GET", at(name)),
  start: (name: string, text: string) => ask<SweepDetail>("POST", "/sweeps", { name, text }),
  stop: (name: string) => ask<SweepDetail>("POST", `${at(name)}/stop`),
  goOn: (name: string) => ask<SweepDetail>("POST", `${at(name)}/go-on`),
  remove: (name: string) => ask<void>("DELETE", at(name)),
};
