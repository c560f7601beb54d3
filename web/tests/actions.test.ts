import { describe, expect, it } from "vitest";
import type { ActionPreset, NumberChoice } from "../src/api/client";
import { actionAt, changed, grid, metadataOf, reachOf, rings, sameSpace, scaleOf, tidy, tip } from "../src/lib/actions";
import { around, differences, diffLines } from "../src/lib/diff";
import { estimate, fromSlider, isSafe, toSlider } from "../src/lib/numberscale";

const space = (actions: ActionPreset["actions"]): ActionPreset => ({
  name: "",
  description: "",
  kind: "discrete",
  actions,
});

describe("an action space", () => {
  it("is drawn and pulled back to the same action", () => {
    for (const action of [
      { steering_angle: -30, speed: 0.5 },
      { steering_angle: 0, speed: 2 },
      { steering_angle: 12.5, speed: 4 },
    ])
      expect(actionAt(...tip(action, 4), 4)).toEqual(action);
  });
  it("stays within what the car can do", () => {
    expect(tidy({ steering_angle: 99, speed: 0 })).toEqual({ steering_angle: 30, speed: 0.1 });
    expect(actionAt(100, 300, 2).speed).toBeLessThanOrEqual(4);
    expect(Object.is(tidy({ steering_angle: -0.1, speed: 1 }).steering_angle, 0)).toBe(true);
  });
  it("leaves room to pull the fastest arrow", () => {
    expect([
      scaleOf(space([{ steering_angle: 0, speed: 1 }]).actions),
      scaleOf([{ steering_angle: 0, speed: 2 }]),
      scaleOf([{ steering_angle: 0, speed: 3 }]),
    ]).toEqual([1, 2.5, 4]);
  });
  it("has rings at round speeds", () => {
    expect([1, 1.5, 2.5, 4].map(rings)).toEqual([
      [0.25, 0.5, 0.75, 1],
      [0.5, 1, 1.5],
      [0.5, 1, 1.5, 2, 2.5],
      [1, 2, 3, 4],
    ]);
  });
  it("is made as the original's console makes it", () => {
    expect(grid(30, 3, 1, 2).map((action) => [action.steering_angle, action.speed])).toEqual([
      [-30, 0.5],
      [-30, 1],
      [0, 0.5],
      [0, 1],
      [30, 0.5],
      [30, 1],
    ]);
  });
  it("is carried with all its digits, and what is left alone keeps them", () => {
    const thirds = grid(30, 7, 4, 3);
    expect(thirds.slice(0, 4)).toEqual([
      { steering_angle: -30, speed: 4 / 3 },
      { steering_angle: -30, speed: 8 / 3 },
      { steering_angle: -30, speed: 4 },
      { steering_angle: -20, speed: 4 / 3 },
    ]);
    expect(changed(thirds[0]!, { steering_angle: -29, speed: 4 / 3 })).toEqual({ steering_angle: -29, speed: 4 / 3 });
    expect(changed(thirds[0]!, { steering_angle: -30, speed: 1.43 })).toEqual({ steering_angle: -30, speed: 1.45 });
    const rounded = thirds.map(({ steering_angle, speed }) => ({ steering_angle, speed: +speed.toFixed(3) }));
    expect(sameSpace(space(thirds), space(rounded))).toBe(false); // and is not taken for another
    expect(metadataOf(space(thirds))["action_space"]).toEqual(thirds.map((one, index) => ({ ...one, index })));
  });
  it("may steer further where a file of 2018 does, and stays such a file", () => {
    const old = [-45, 0, 45].map((steering_angle) => ({ steering_angle, speed: 1 }));
    expect([reachOf(old), reachOf(grid(30, 3, 1, 2))]).toEqual([45, 30]);
    expect(changed(old[0]!, { steering_angle: -45, speed: 2 }, reachOf(old))).toEqual({
      steering_angle: -45,
      speed: 2,
    });
    expect(changed(old[0]!, { steering_angle: -60, speed: 1 }, reachOf(old))).toEqual({
      steering_angle: -45,
      speed: 1,
    });
    expect(metadataOf(space(old))["version"]).toBe("2");
    expect(metadataOf(space(grid(30, 3, 1, 2)))["version"]).toBe("5");
  });
  it("knows whether it is a preset's", () => {
    expect(sameSpace(space(grid(30, 3, 1, 2)), space(grid(30, 3, 1, 2)))).toBe(true);
    expect(sameSpace(space(grid(30, 3, 1, 2)), space(grid(29, 3, 1, 2)))).toBe(false);
    const box = (low: number): ActionPreset => ({
      ...space([]),
      kind: "continuous",
      steering_angle: [low, 30],
      speed: [0.5, 4],
    });
    expect([sameSpace(box(-30), box(-30)), sameSpace(box(-30), box(-20))]).toEqual([true, false]);
    expect(metadataOf(box(-30))).toMatchObject({ action_space: { steering_angle: { low: -30, high: 30 } } });
  });
});

describe("numbers of learning", () => {
  const rate: NumberChoice = {
    name: "lr",
    default: 3e-4,
    low: 1e-5,
    high: 1e-2,
    safe_low: 1e-4,
    safe_high: 2e-3,
    is_whole: false,
    is_logarithmic: true,
    allowed: null,
  };
  it("come back from their slider", () => {
    for (const value of [1e-5, 3e-4, 1e-2]) expect(fromSlider(rate, toSlider(rate, value))).toBeCloseTo(value, 5);
    const batch = {
      ...rate,
      low: 32,
      high: 512,
      is_logarithmic: false,
      is_whole: true,
      allowed: [32, 64, 128, 256, 512],
    };
    expect(fromSlider(batch, toSlider(batch, 128))).toBe(128);
    expect(toSlider(rate, Number.NaN)).toBe(0);
  });
  it("know where they are safe", () => {
    expect([isSafe(rate, 1e-4), isSafe(rate, 5e-3)]).toEqual([true, false]);
  });
});

describe("an estimate", () => {
  it("reads limits of time and steps", () => {
    expect(estimate("10 minutes", 0)).toBe(600);
    expect(estimate("200,000 steps", 5000)).toBe(40);
    expect(estimate("5 laps or 90 s or 1 h", 5000)).toBe(90);
    expect(estimate("8.8 s lap", 5000)).toBeNull();
    expect(estimate("1000 steps", 0)).toBeNull();
  });
});

describe("what differs", () => {
  it("is the shortest way from one text to the other", () => {
    const lines = diffLines("a\nb\nc\nd", "a\nx\nc\nd\ne");
    expect(lines.map((line) => `${line.kind[0]}${line.text}`)).toEqual(["sa", "rb", "ax", "sc", "sd", "ae"]);
    expect(lines.map((line) => line.after)).toEqual([1, null, 2, 3, 4, 5]);
    expect(diffLines("a", "a").every((line) => line.kind === "same")).toBe(true);
  });
  it("is shown with a little around it", () => {
    const text = Array.from({ length: 40 }, (_, index) => String(index));
    const shown = around(diffLines(text.join("\n"), text.with(20, "x").join("\n")), 2);
    expect(shown.filter((line) => line).length).toBe(6);
    expect(shown[shown.length - 1]).toBeNull();
    expect(around(diffLines("a\nb", "a\nb"))).toEqual([]);
  });
  it("holds for settings, too", () => {
    expect(
      differences([
        { a: 1, b: { c: "x" } },
        { a: 1, b: { c: "y" }, d: [1] },
      ]),
    ).toEqual([
      { name: "b.c", values: ["x", "y"] },
      { name: "d", values: [undefined, "[1]"] },
    ]);
  });
});
