import { expect, test } from "vitest";
import { carColor, hueOf, LINE_FROM, lineRange, onLine, scale } from "../src/lib/colors";

test("a line along a lap has the whole scale between what nearly all of it is, and no more beyond", () => {
  const speeds = [9, ...Array.from({ length: 98 }, (_, index) => 1 + index / 97), 0];
  const [low, high] = lineRange(speeds, 0.5);
  expect(low).toBeCloseTo(1.02, 2);
  expect(high).toBeCloseTo(2, 2);
  expect([onLine(low, [low, high]), onLine(high, [low, high]), onLine(9, [low, high])]).toEqual([
    scale(LINE_FROM),
    scale(1),
    scale(1),
  ]);
  expect(lineRange([1, 1.1], 0.5).map((one) => +one.toFixed(2))).toEqual([0.8, 1.3]);
});

test("cars that learn go from blue at the start to orange at the finish, and not beyond", () => {
  expect([hueOf(-1), hueOf(0), hueOf(1), hueOf(2)].map((hue) => Math.round(360 * hue))).toEqual([209, 209, 29, 29]);
  expect(carColor(1)).toBe("hsl(29 75% 55%)");
});
