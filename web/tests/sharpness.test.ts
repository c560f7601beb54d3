import { describe, expect, it } from "vitest";
import { Sharpness } from "../src/scene/sharpness";

const draw = (sharpness: Sharpness, frames: number, time: (frame: number) => number): number => {
  let changes = 0;
  for (let frame = 0; frame < frames; frame++) {
    const before = sharpness.ratio;
    sharpness.took(time(frame));
    changes += Number(sharpness.ratio !== before);
  }
  return changes;
};

describe("the picture", () => {
  it("gets coarser while frames are slow, down to a limit", () => {
    const sharpness = new Sharpness(2, 0.6, 2);
    draw(sharpness, 10, () => 50);
    expect(sharpness.ratio).toBeCloseTo(1.6);
    draw(sharpness, 200, () => 50);
    expect(sharpness.ratio).toBe(0.6);
    expect(draw(sharpness, 200, () => 50)).toBe(0);
  });
  it("stays as it is at a good pace, and at the screen's own sharpness", () => {
    expect(draw(new Sharpness(1, 0.6, 0.7), 500, () => 25)).toBe(0);
    expect(draw(new Sharpness(1, 0.6, 1), 500, () => 8)).toBe(0);
  });
  it("does not mind single slow frames, nor that nobody looked", () => {
    expect(draw(new Sharpness(1, 0.6, 1), 500, (frame) => (frame % 4 ? 10 : 200))).toBe(0);
    expect(draw(new Sharpness(1, 0.6, 1), 500, () => 2000)).toBe(0);
  });
  it("gets sharper again, and tries ever more rarely what was too slow", () => {
    const sharpness = new Sharpness(1, 0.6, 0.7);
    draw(sharpness, 40, () => 10);
    expect(sharpness.ratio).toBeGreaterThan(0.8);
    const changes = (frames: number) => draw(sharpness, frames, () => (sharpness.ratio > 0.9 ? 50 : 10));
    const early = changes(500);
    expect(early).toBeGreaterThan(4);
    changes(3000);
    expect(changes(500)).toBeLessThan(early / 2);
  });
});
