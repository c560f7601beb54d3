import { expect, test } from "vitest";
import type { LogEntry } from "../src/lib/curves";
import { among, asText, searchOf, story, wantedBy } from "../src/lib/log";
import { loose } from "../src/lib/numbers";

const judged = (kind: "best" | "evaluation", seconds: number, lap: number): LogEntry => ({
  ...{ kind, seconds, step: 1000 * seconds },
  point: {
    ...{ kind: "evaluation", step: 1000 * seconds, seconds, is_best: kind === "best" },
    ...{ lap_times: [lap], completions: [1, 0.5] },
  },
});
const note: LogEntry = {
  ...{ kind: "note", seconds: 1, step: 7 },
  point: { kind: "note", step: 7, seconds: 1, text: "Stopped by its owner." },
};
const ENTRIES = [judged("evaluation", 75, 9.5), judged("best", 60, 9.25), note];

test("an address says what is wanted of a log, and what is no kind or too long is left", () => {
  for (const wanted of [
    { kind: "best", words: "9.25 s & more" },
    { kind: "all", words: "" },
  ] as const)
    expect(wantedBy(searchOf(wanted))).toEqual(wanted);
  expect(searchOf({ kind: "all", words: "" })).toBe("");
  expect(wantedBy(`?kind=worst&words=${"x".repeat(500)}`)).toEqual({ kind: "all", words: "x".repeat(100) });
});

test("entries are narrowed by kind and words; the best is an evaluation, too", () => {
  expect(among(ENTRIES, { kind: "evaluation", words: "" })).toEqual(ENTRIES.slice(0, 2));
  expect(among(ENTRIES, { kind: "best", words: "" })).toEqual([ENTRIES[1]]);
  expect(among(ENTRIES, { kind: "all", words: " STOPPED " })).toEqual([note]);
  expect(among(ENTRIES, { kind: "all", words: "9.25 s" })).toEqual([ENTRIES[1]]); // as it is typed
  expect(among(ENTRIES, { kind: "note", words: "9.25" })).toEqual([]);
});

test("a file has a line each, oldest first", () => {
  expect(asText(ENTRIES).split("\n")).toEqual([
    "0:01\t7\tStopped by its owner.",
    `1:00\t60000\t${loose(story(ENTRIES[1]!))}`,
    `1:15\t75000\t${loose(story(ENTRIES[0]!))}`,
    "",
  ]);
  expect(story(ENTRIES[1]!)).toContain("1 of 2 laps, 75\u00a0%, 9.25\u00a0s");
});
