/** What tracks are called on every page; the server, addresses and settings know them by their names. */
import { api } from "../api/client";
import { roadName } from "./roads";

let titles = $state.raw<ReadonlyMap<string, string>>(new Map());
const asked: string[] = []; // names that were looked for: one that is gone is not looked for again
let isAsking = false;

/** The title of a track; its name until that is known, and where it has none. */
export function titleOf(name: string): string {
  if (name && !titles.has(name) && !asked.includes(name)) {
    asked.push(name);
    void ask();
  }
  return roadName(name, (road) => titles.get(road));
}

async function ask(): Promise<void> {
  if (isAsking) return;
  isAsking = true;
  try {
    titles = new Map((await api.tracks()).map((track) => [track.name, track.title]));
  } catch {
    asked.length = 0; // the names stand there meanwhile
  }
  isAsking = false;
}
