/** Driving by hand. */
import { ask } from "./client";
import type { components } from "./schema";

type Schemas = components["schemas"];
export type Drive = Schemas["Drive"];
export type DriveState = Schemas["DriveState"];
export type DrivenLap = NonNullable<DriveState["finished"]>;
export type DriveMode = "ready" | "driving" | "paused";
export type GhostCard = Schemas["GhostCard"];
export type Ghost = Schemas["Ghost"];
export type Settings = { vehicle: "v4" | "v5" | "v6"; direction: "forward" | "reverse" };

const name = encodeURIComponent;
const query = (track: string, settings: Settings) =>
  `track=${name(track)}&vehicle=${settings.vehicle}&direction=${settings.direction}`;

export const driveApi = {
  begin: (drive: Partial<Schemas["NewDrive"]>) => ask<Drive>("POST", "/drives", drive),
  step: (id: string, controls: Schemas["Controls"]) => ask<DriveState>("POST", `/drives/${id}/steps`, controls),
  end: (id: string) => ask<void>("DELETE", `/drives/${id}`),
  ghosts: (track: string, settings: Settings) => ask<GhostCard[]>("GET", `/ghosts?${query(track, settings)}`),
  ghost: (key: string, track: string, settings: Settings) =>
    ask<Ghost>("GET", `/ghosts/${name(key)}?${query(track, settings)}`),
};
