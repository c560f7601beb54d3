import { expect, test } from "vitest";
import { colorsOf, placeAt, secondsOf, type EvolutionLap } from "./evolution";

const LAP: EvolutionLap = {
  step: 512,
  stretch: 1,
  seconds: null,
  completion: 0.2,
  poses: [
    [0, 0, 3100],
    [1000, 500, -3100],
    [2000, 1000, -3000],
  ],
};

test("a car is between two poses between two moments, and turns the short way", () => {
  expect(secondsOf(LAP)).toBeCloseTo(2 / 15);
  const half = placeAt(LAP, 0.5 / 15);
  expect([half.x, half.y]).toEqual([0.5, 0.25]);
  expect(Math.cos(half.heading)).toBeCloseTo(-1, 3);
});

test("before the start and after the end it stands", () => {
  expect(placeAt(LAP, -1)).toEqual(placeAt(LAP, 0));
  expect(placeAt(LAP, 99)).toMatchObject({ x: 2, y: 1, heading: -3 });
});

test("every car has a colour of its own", () => {
  expect(new Set(colorsOf(8)).size).toBe(8);
  expect(colorsOf(1)).toHaveLength(1);
});
