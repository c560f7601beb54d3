/** What tracks are called on every page; the server, addresses and settings know them by their names. */
import { api } from "../api/client";
import { roadName } from "./roads";

let titles = $state.raw<ReadonlyMap<string, string>>(new Map());
const asked: string[] = []; // names that were looked for: one that is gone is not looked for again
let isAsking = false;
let hasAnswer = $state(false); // perhaps that there is none

/** Stands where titles are not known yet: a name would jump. */
const SOON = "…";

/** The title of a track; its name where it has none, or where titles cannot be had. */
export function titleOf(name: string): string {
  if (name && !titles.has(name) && !asked.includes(name)) {
    asked.push(name);
    void ask();
  }
  return roadName(name, (road) => titles.get(road) ?? (hasAnswer ? undefined : SOON));
}

async function ask(): Promise<void> {
  if (isAsking) return;
  isAsking = true;
  try {
    titles = new Map((await api.tracks()).map((track) => [track.name, track.title]));
  } catch {
    asked.length = 0; // the names stand there meanwhile
  }
  hasAnswer = true;
  isAsking = false;
}
