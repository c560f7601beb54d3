/** How a lap ended, in the page's language; files have AWS's words, in two spellings. */
import type { Key } from "../i18n/en";

const ENDINGS: Record<string, Key> = {
  lap_complete: "end_lap_complete",
  off_track: "end_off_track",
  crashed: "end_crashed",
  reversed: "end_reversed",
  immobilized: "end_immobilized",
  time_up: "end_time_up",
  in_progress: "end_in_progress",
};

/** The catalogue's key for what a file says; nothing for words that it does not know. */
export const endingOf = (status: string): Key | undefined => ENDINGS[status.toLowerCase().replaceAll(" ", "_")];
