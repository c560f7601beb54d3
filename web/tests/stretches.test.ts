import { expect, test } from "vitest";
import type { Point } from "../src/lib/curves";
import { lastTurn, stretchAt } from "../src/lib/stretches";

const stretches = [{ step: 0 }, { step: 4096 }];
const judged = (step: number, laps: number[], completion = 1): Point => ({
  kind: "evaluation",
  step,
  seconds: step / 1000,
  lap_times: laps,
  completions: [completion],
});

test("a step belongs to the stretch that trained up to it", () => {
  expect([0, 1, 4096, 4097].map((step) => stretches.indexOf(stretchAt(stretches, step)))).toEqual([0, 0, 0, 1]);
});

test("the last change is judged by the laps on both sides of it", () => {
  const before = [judged(1024, [], 0.2), judged(2048, [9]), judged(3072, [11]), judged(4096, [10.5])];
  expect(lastTurn(stretches, before)).toBeUndefined();
  expect(lastTurn(stretches, [...before, judged(5120, [15.1])])).toEqual({
    stretch: stretches[1],
    laps: [9, 15.1],
    completions: [1, 1],
  });
  expect(lastTurn(stretches, [...before, judged(5120, [], 0.03)])).toMatchObject({
    laps: [9, null],
    completions: [1, 0.03],
  });
  expect(lastTurn([{ step: 0 }], before)).toBeUndefined();
});
