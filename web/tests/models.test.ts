import { describe, expect, it } from "vitest";
import { canDrive } from "../src/lib/models";

describe("a model that can drive", () => {
  it("has learned here or elsewhere", () => {
    expect(canDrive({ steps: 512, status: "stopped" })).toBe(true);
    expect(canDrive({ steps: 0, status: "finished" })).toBe(true);
    expect(canDrive({ steps: 0, status: "new" })).toBe(false);
    expect(canDrive({ steps: 0, status: "failed" })).toBe(false);
  });
});
