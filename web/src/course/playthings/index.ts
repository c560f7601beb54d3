/** What to play with in lessons, by the names that their files say. */
import type { Component } from "svelte";

export const playthings: Record<string, () => Promise<{ default: Component }>> = {
  bandit: () => import("./Bandit.svelte"),
  clip: () => import("./Clip.svelte"),
  gae: () => import("./Gae.svelte"),
  grid: () => import("./Grid.svelte"),
  lap: () => import("./Lap.svelte"),
  track: () => import("./Track.svelte"),
};
