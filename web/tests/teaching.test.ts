import { describe, expect, it } from "vitest";
import { hasTeacherNow } from "../src/lib/teaching";

describe("a training with a teacher", () => {
  it("has one until the cars take their first step", () => {
    expect([undefined, 0, 512].map((step) => hasTeacherNow({ algorithm: "distill" }, step))).toEqual([
      true,
      true,
      false,
    ]);
    expect([undefined, 0, 512].some((step) => hasTeacherNow({ algorithm: "ppo" }, step))).toBe(false);
  });
});
