import { expect, test } from "vitest";
import { medalOf, missedBy, nextMedal } from "./medals";

const TIMES = { author: 10, gold: 10.6, silver: 12, bronze: 15 };

test("a lap wins the best medal that it reaches, the very time included", () => {
  expect([9.5, 10, 10.01, 10.6, 11, 12.5, 15, 15.01].map((seconds) => medalOf(TIMES, seconds))).toEqual([
    "author",
    "author",
    "gold",
    "gold",
    "silver",
    "bronze",
    "bronze",
    "",
  ]);
});

test("without a lap, and where no times are known, there is none", () => {
  expect(medalOf(TIMES, null)).toBe("");
  expect(medalOf(null, 9)).toBe("");
});

test("what is next is the medal just missed, the first one without a lap, and nothing behind the author's", () => {
  expect([null, 16, 15, 12.5, 12, 10.6, 10.3, 10].map((seconds) => nextMedal(TIMES, seconds))).toEqual([
    ...["bronze", "bronze", "silver", "silver", "gold", "author", "author", ""],
  ]);
  expect(nextMedal(undefined, 9)).toBe("");
});

test("who makes up what a lap misses a medal by has the medal", () => {
  expect([12.42, 12.001, 12.009].map((seconds) => missedBy(TIMES, "silver", seconds))).toEqual([0.42, 0.01, 0.01]);
  expect(missedBy({ ...TIMES, silver: 5.9 }, "silver", 6.32)).toBe(0.42);
});
