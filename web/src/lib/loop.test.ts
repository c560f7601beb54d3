import { expect, test } from "vitest";
import { lookAt } from "./loop";

const lap = { step: 9, seconds: 0.2, poses: [0, 1, 2].map((x) => [x, 0, 0, 0, 0, 0]) };
const at = (steps: number) => lookAt(lap, (steps + 0.5) * (1000 / 15)).poses[0]![0];

test("a lap is driven in its own time, waits a second at its end, and begins again", () => {
  expect([0, 1, 2, 3, 17, 18, 19].map(at)).toEqual([0, 1, 2, 2, 2, 0, 1]);
});
