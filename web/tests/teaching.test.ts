import { describe, expect, it } from "vitest";
import { hasTeacherNow, lessonOf, paceOf } from "../src/lib/teaching";

describe("a training with a teacher", () => {
  it("has one until the cars take their first step", () => {
    expect([undefined, 0, 512].map((step) => hasTeacherNow({ algorithm: "distill" }, step))).toEqual([
      true,
      true,
      false,
    ]);
    expect([undefined, 0, 512].some((step) => hasTeacherNow({ algorithm: "ppo" }, step))).toBe(false);
  });

  it("is told how much the teacher has learned, until its student has driven", () => {
    const point = { kind: "iteration" as const, step: 0, seconds: 1 };
    const told = (lesson: unknown, steps = 0) => lessonOf({ ...point, lesson }, steps);
    expect([0, 0.29, 0.4267, 0.9999, 1].map((lesson) => told(lesson))).toEqual([0, 0.29, 0.42, 0.99, 1]);
    expect([lessonOf(undefined, 0), lessonOf(point, 0), told(null), told(1, 512)]).toEqual([null, null, null, null]);
  });

  it("has no camera steps a second before its student drives", () => {
    const point = { kind: "iteration" as const, step: 0, seconds: 1 };
    expect([
      paceOf({ ...point, pace: 0, lesson: 0.5 }),
      paceOf({ ...point, pace: 0 }),
      paceOf({ ...point, step: 512, pace: 1350.2 }),
      paceOf(point),
      paceOf(undefined),
    ]).toEqual([null, 0, 1350.2, null, null]);
  });
});
