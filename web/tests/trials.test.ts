import { expect, test } from "vitest";
import type { TuningCard, TuningTrial } from "../src/api/tunings";
import { bestSoFar, ranked, yours } from "../src/lib/trials";

const trial = (number: number, value: number | null, state = "complete", gamma = 0.9): TuningTrial => ({
  number,
  state,
  value,
  params: { gamma },
  completion: 1,
  best_lap: null,
  steps: value,
  error: "",
  can_be_kept: true,
});
const trials = [
  trial(0, 500),
  trial(1, null, "fail"),
  trial(2, 300, "complete", 0.95),
  trial(3, 300),
  trial(4, 200, "pruned"),
  trial(5, 400),
];

test("the best come first, the earlier of equals, and what did not end well last", () => {
  expect(ranked(trials).map((one) => one.number)).toEqual([2, 3, 5, 0, 1, 4]);
});

test("the best so far never gets worse, and only completed trials count", () => {
  expect(bestSoFar(trials).map((row) => [row.number, row.best])).toEqual([
    [0, 500],
    [2, 300],
    [3, 300],
    [5, 300],
  ]);
});

test("the trial with the numbers of now is found by them", () => {
  const space = [{ name: "gamma", default: 0.95 }] as TuningCard["space"];
  expect(yours({ space, trials } as TuningCard)?.number).toBe(2);
  expect(yours({ space: [{ ...space[0]!, default: 0.5 }], trials } as TuningCard)).toBeUndefined();
});
