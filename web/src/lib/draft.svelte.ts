/** The track that is being drawn: it outlives a test drive and a reload of the page. */
import { tab } from "./remembered";
import type { Sketch } from "./sketch";

const KEY = "racecraft-draft";

interface Draft {
  sketch: Sketch;
  name: string;
  of: string;
}

function read(): Draft | undefined {
  try {
    const found = JSON.parse(tab.read(KEY) ?? "null") as Draft | null;
    return found && Array.isArray(found.sketch?.points) ? found : undefined;
  } catch {
    return undefined;
  }
}

export const draft = { now: read() };

export function keep(now: Draft | undefined): void {
  draft.now = now;
  tab.write(KEY, now ? JSON.stringify(now) : null);
}
