/** Tracks that are drawn and imported. */
import { ask, askBytes, type TrackFacts } from "./client";
import type { components } from "./schema";
import type { Sketch } from "../lib/sketch";

export type SketchVerdict = components["schemas"]["SketchVerdict"];
const name = encodeURIComponent;

export const trackApi = {
  judge: (sketch: Sketch) => ask<SketchVerdict>("POST", "/tracks/validate", sketch),
  sketch: (track: string) => ask<Sketch>("GET", `/tracks/${name(track)}/sketch`),
  save: (track: string, sketch: Sketch, replace: boolean) =>
    ask<TrackFacts>("PUT", `/tracks/${name(track)}?replace=${replace}`, sketch),
  take: (file: File) => askBytes<TrackFacts>("POST", `/tracks/import?file=${name(file.name)}`, file),
  remove: (track: string) => ask<void>("DELETE", `/tracks/${name(track)}`),
  restore: (track: string) => ask<TrackFacts>("POST", `/tracks/${name(track)}/restore`),
};

export const routeOf = (track: string) => `/api/tracks/${name(track)}/route.npy`;
