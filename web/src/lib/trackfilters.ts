/** Tracks by what they are like: length, width, difficulty and direction. */
import type { TrackFacts } from "../api/client";

type Measured = Pick<TrackFacts, "length" | "mean_width" | "min_radius" | "corners" | "direction">;

/** How hard a track is for a beginner: its tightest bend measured in its own width, and how many bends a lap has. */
export function difficulty(track: Measured): "track_easy" | "track_medium" | "track_hard" {
  const room = (track.min_radius ?? Infinity) / Math.max(track.mean_width, 0.1);
  if (track.mean_width < 0.7 || room < 1 || track.corners > 11) return "track_hard";
  return room >= 1.5 && track.corners <= 5 ? "track_easy" : "track_medium";
}

/** A group is what one may be: traits of one group widen the choice, other groups narrow it. */
export const TRAITS = [
  { key: "tracks_short", group: "length", is: (track: Measured) => track.length < 20 },
  { key: "long", group: "length", is: (track: Measured) => track.length >= 25 },
  { key: "easy", group: "width", is: (track: Measured) => track.mean_width >= 1 },
  { key: "narrow", group: "width", is: (track: Measured) => track.mean_width < 0.8 },
  { key: "track_easy", group: "difficulty", is: (track: Measured) => difficulty(track) === "track_easy" },
  { key: "track_medium", group: "difficulty", is: (track: Measured) => difficulty(track) === "track_medium" },
  { key: "track_hard", group: "difficulty", is: (track: Measured) => difficulty(track) === "track_hard" },
  { key: "tracks_left", group: "direction", is: (track: Measured) => track.direction === "counter-clockwise" },
  { key: "tracks_right", group: "direction", is: (track: Measured) => track.direction === "clockwise" },
] as const;

export type Trait = (typeof TRAITS)[number]["key"];

/** Whether a track has one of the chosen traits of every group that any is chosen of. */
export function fits(track: Measured, chosen: readonly Trait[]): boolean {
  const wanted = TRAITS.filter((trait) => chosen.includes(trait.key));
  return wanted.every(({ group }) => wanted.some((trait) => trait.group === group && trait.is(track)));
}
