import { describe, expect, it } from "vitest";
import { Pace } from "../src/scene/pace";

/** Frames drawn of those of a screen over a second. */
function drawn(period: number, rate: number, from = 0): number[] {
  const pace = new Pace(period);
  return Array.from({ length: rate }, (_, frame) => from + (1000 * frame) / rate).filter((time) => pace.isDue(time));
}

describe("Pace", () => {
  it("draws every frame of any screen where nothing is to be saved", () => {
    for (const rate of [30, 60, 75, 144]) expect(drawn(0, rate)).toHaveLength(rate);
  });

  it("draws so many a second of a faster screen, from whenever it begins", () => {
    for (const rate of [60, 75, 120, 144]) {
      expect(drawn(25, rate).length).toBeGreaterThanOrEqual(39);
      expect(drawn(25, rate, 1e6).length).toBeLessThanOrEqual(41);
    }
  });

  it("draws every frame of a slower screen", () => {
    expect(drawn(25, 30)).toHaveLength(30);
    expect(drawn(25, 40)).toHaveLength(40);
  });

  it("never leaves out two in a row of a usual screen, and makes up for no long pause", () => {
    const times = drawn(25, 60);
    const gaps = times.slice(1).map((time, index) => time - times[index]!);
    expect(Math.max(...gaps)).toBeLessThan(34);
    const pace = new Pace(25);
    expect([0, 5000, 5008, 5016, 5024].map((time) => pace.isDue(time))).toEqual([true, true, true, false, true]);
  });
});
