/** What files are that somebody dropped onto the page, by their names: nobody reads more of one that this page has no use for. */
import type { ActionPreset } from "../api/client";
import { textOf } from "../lib/filetext";

const MOST_BYTES = 140_000; // of a text, the most that AWS accepts of a reward

export type Dropped =
  { kind: "model" | "replay" } | { kind: "reward"; source: string } | { kind: "actions"; space: ActionPreset };

/** Of several files those that there is a place for: every model, and the first of each other kind; the others are left. */
export function placedOf<Found extends { dropped: Dropped }>(found: Found[]): { placed: Found[]; left: Found[] } {
  const hasPlace = ({ dropped }: Found, index: number) =>
    dropped.kind === "model" || found.findIndex((one) => one.dropped.kind === dropped.kind) === index;
  return { placed: found.filter(hasPlace), left: found.filter((one, index) => !hasPlace(one, index)) };
}

/** Undefined where it is none of these, or does not hold what its name says. */
export async function droppedOf(file: File): Promise<Dropped | undefined> {
  const name = file.name.toLowerCase();
  if (/\.(tar\.gz|tgz|gz)$/.test(name)) return { kind: "model" };
  if (name.endsWith(".replay")) return { kind: "replay" };
  if (!/\.(py|json)$/.test(name) || file.size > MOST_BYTES) return undefined;
  try {
    const text = textOf(await file.arrayBuffer());
    if (text === undefined) return undefined;
    if (name.endsWith(".py")) return { kind: "reward", source: text.replaceAll("\r\n", "\n") };
    const { actionsOf } = await import("./arrive");
    return { kind: "actions", space: actionsOf(text) };
  } catch {
    return undefined;
  }
}
