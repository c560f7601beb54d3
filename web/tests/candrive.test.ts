import { describe, expect, it } from "vitest";
import { canDrive, type ModelCard } from "../src/api/client";

const card = (steps: number, status: ModelCard["status"]) => ({ steps, status }) as ModelCard;

describe("a model that can drive", () => {
  it("has learned here or elsewhere", () => {
    expect(canDrive(card(512, "stopped"))).toBe(true);
    expect(canDrive(card(0, "finished"))).toBe(true);
    expect(canDrive(card(0, "new"))).toBe(false);
    expect(canDrive(card(0, "failed"))).toBe(false);
  });
});
