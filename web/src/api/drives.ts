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

/** Who keeps the car that somebody drives, and the laps to drive against: the server, or a worker of the page. */
export interface Seat {
  hasGhosts: boolean;
  begin(settings: Settings): Promise<Drive>;
  step(id: string, controls: Schemas["Controls"]): Promise<DriveState>;
  end(id: string): void;
  ghosts(settings: Settings): Promise<GhostCard[]>;
  ghost(key: string, settings: Settings): Promise<Ghost>;
}

const name = encodeURIComponent;
const query = (track: string, settings: Settings) =>
  `track=${name(track)}&vehicle=${settings.vehicle}&direction=${settings.direction}`;

/** The server's: on a track of a name, or on one that is being drawn, which has no name. */
export const seatAt = (place: () => Partial<Schemas["NewDrive"]>, track: string): Seat => ({
  hasGhosts: track !== "",
  begin: async (settings) => ask<Drive>("POST", "/drives", { ...settings, ...place() }),
  step: (id, controls) => ask<DriveState>("POST", `/drives/${id}/steps`, controls),
  end: (id) => void ask<void>("DELETE", `/drives/${id}`).catch(() => undefined),
  ghosts: (settings) => ask<GhostCard[]>("GET", `/ghosts?${query(track, settings)}`),
  ghost: (key, settings) => ask<Ghost>("GET", `/ghosts/${name(key)}?${query(track, settings)}`),
});
