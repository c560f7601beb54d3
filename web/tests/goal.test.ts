import { describe, expect, it } from "vitest";
import { goalOf, textOf } from "../src/lib/goal";

describe("when a training ends", () => {
  it("is read back as it was said", () => {
    for (const until of [
      "5 laps",
      "8.8 s lap",
      "10 minutes",
      "64 steps",
      "20 laps or 10 minutes",
      "9 s lap or 1 minutes",
    ])
      expect(textOf(goalOf(until)!)).toBe(until);
  });
  it("is understood as people write it", () => {
    expect(goalOf(" 1 Lap OR 90 min ")).toEqual({ kind: "laps", amount: 1, most: 90 });
    expect(goalOf("200,000 steps")).toEqual({ kind: "steps", amount: 200000, most: undefined });
    expect(goalOf("9 seconds  lap")).toEqual({ kind: "lap", amount: 9, most: undefined });
  });
  it("stays in words where there are no fields for it", () => {
    for (const until of [
      "",
      "no better lap",
      "90 s",
      "2 hours",
      "null laps",
      "5 laps or 900 steps",
      "5 minutes or 9 steps",
    ])
      expect(goalOf(until)).toBeUndefined();
    expect(goalOf("5 laps or 10 minutes or 900 steps")).toBeUndefined();
    expect(goalOf("5 laps or")).toBeUndefined();
  });
});
