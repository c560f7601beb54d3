import { expect, test } from "vitest";
import type { Demonstration } from "../api/client";
import { lookAt } from "./loop";

const lap = {
  step: 9,
  seconds: 0.2,
  poses: [0, 1, 2].map((x) => [x, 0, 0, 0, 0, 0]),
  objects: [
    { kind: "bot_car", x: [1, 1.5, 2], y: [0, 0, 0], heading: [0, 0, 0.5] },
    { kind: "box", x: [3], y: [4], heading: [1] },
  ],
} as unknown as Demonstration;
const at = (steps: number) => lookAt(lap, (steps + 0.5) * (1000 / 15)).poses[0]![0];

test("a lap is driven in its own time, waits a second at its end, and begins again", () => {
  expect([0, 1, 2, 3, 17, 18, 19].map(at)).toEqual([0, 1, 2, 2, 2, 0, 1]);
});

test("what it met moves as it did then, and what stood stands", () => {
  const met = (steps: number) => lookAt(lap, (steps + 0.5) * (1000 / 15)).objects;
  const box = ["box", 3000, 4000, 1000];
  expect(met(1)).toEqual([["bot_car", 1500, 0, 0], box]);
  expect(met(10)).toEqual([["bot_car", 2000, 0, 500], box]);
});
