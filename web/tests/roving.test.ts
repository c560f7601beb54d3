import { expect, it } from "vitest";
import { next } from "../src/lib/roving";

it("goes round a group with the arrow keys, and to its ends", () => {
  expect(["ArrowRight", "ArrowDown", "ArrowLeft", "ArrowUp", "Home", "End"].map((key) => next(key, 0, 3))).toEqual([
    1, 1, 2, 2, 0, 2,
  ]);
  expect(next("ArrowRight", 2, 3)).toBe(0);
  expect(next("a", 1, 3)).toBeUndefined();
});
