/** What happened in a training, as people read it, and which of it an address asks for: /models/NAME/log?kind=best&words=9. */
import { said, t } from "../i18n/index.svelte";
import { bestLapOf, completionOf, type LogEntry } from "./curves";
import { clock, loose, percent, seconds } from "./numbers";

export const KINDS = ["all", "evaluation", "best", "note"] as const;
export interface Wanted {
  kind: (typeof KINDS)[number];
  words: string;
}

const MOST_WORDS = 100; // characters

export function wantedBy(search: string): Wanted {
  const asked = new URLSearchParams(search);
  const kind = KINDS.find((one) => one === asked.get("kind")) ?? "all";
  return { kind, words: (asked.get("words") ?? "").slice(0, MOST_WORDS) };
}

/** What stands behind the address of a log of which so much is wanted. */
export function searchOf({ kind, words }: Wanted): string {
  const asked = new URLSearchParams({ ...(kind === "all" ? {} : { kind }), ...(words ? { words } : {}) });
  return asked.size ? `?${asked}` : "";
}

export function story({ point }: LogEntry): string {
  if (point.kind === "note") return said(String(point["text"] ?? ""));
  const lap = bestLapOf(point);
  return t(point["is_best"] ? "log_best" : "log_evaluation", {
    laps: (point["lap_times"] as number[]).length,
    trials: (point["completions"] as number[]).length,
    completion: percent(completionOf(point)),
    lap: lap === null ? "" : `, ${seconds(lap)}`,
  });
}

/** The entries that are wanted; what is the best so far is an evaluation, too. */
export const among = (entries: LogEntry[], { kind, words }: Wanted): LogEntry[] =>
  entries.filter(
    (entry) =>
      (kind === "all" || entry.kind === kind || (kind === "evaluation" && entry.kind === "best")) &&
      loose(story(entry)).toLowerCase().includes(words.trim().toLowerCase()),
  );

/** A line each, oldest first, as logs are. */
export const asText = (entries: LogEntry[]): string =>
  entries
    .toReversed()
    .map((entry) => `${clock(entry.seconds)}\t${entry.step}\t${loose(story(entry))}\n`)
    .join("");
