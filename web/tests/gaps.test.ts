import { describe, expect, it } from "vitest";
import { leavingOf, reachOf } from "../src/lib/gaps";

/** A car that is so many seconds behind, growing evenly. */
const growing = (most: number, count = 100) =>
  Array.from({ length: count }, (_, index) => (most * (index + 1)) / count);
const first = growing(0);

describe("what a graph of gaps shows", () => {
  it("is everything where all are close, or one after the other", () => {
    expect(reachOf([first, growing(0.4)])).toBeUndefined();
    expect(reachOf([first, growing(3), growing(10), growing(30)])).toBeUndefined();
    expect(reachOf([first, growing(120)])).toBeUndefined(); // there is nobody else to look at
    expect(reachOf([first, first])).toBeUndefined();
    expect(reachOf([])).toBeUndefined();
    expect(reachOf([first, Array.from({ length: 9 }, () => null)])).toBeUndefined();
  });
  it("is those that are close where another one is minutes behind", () => {
    expect(reachOf([first, growing(2), growing(150)])).toBe(2);
    expect(reachOf([first, growing(2).map((gap) => -gap), growing(150)])).toBe(2);
    expect(reachOf([first, growing(0.1), growing(150)])).toBe(1); // noise does not fill it
  });
  it("is where a car mostly is, not its worst moment", () => {
    const late = [...Array.from({ length: 80 }, () => 0.5), ...Array.from({ length: 20 }, () => 90)];
    expect(reachOf([first, late])).toBe(2);
    const stopped = [...growing(2, 60), ...Array.from({ length: 40 }, () => null)]; // it did not finish
    expect(reachOf([first, stopped, growing(150)])).toBe(2);
  });
  it("tells where a car leaves it, and how far it gets", () => {
    expect(leavingOf([0, 1, null, 3, 80, 60], 2)).toEqual({ index: 3, most: 80 });
    expect(leavingOf([0, -1, -5, -3], 2)).toEqual({ index: 2, most: -5 });
    expect(leavingOf([0, 2, null], 2)).toBeUndefined();
  });
});
