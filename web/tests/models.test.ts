import { describe, expect, it } from "vitest";
import { canDrive, isFound, lookedAt } from "../src/lib/models";

describe("a model that can drive", () => {
  it("has learned here or elsewhere", () => {
    expect(canDrive({ steps: 512, status: "stopped" })).toBe(true);
    expect(canDrive({ steps: 0, status: "finished" })).toBe(true);
    expect(canDrive({ steps: 0, status: "new" })).toBe(false);
    expect(canDrive({ steps: 0, status: "failed" })).toBe(false);
  });
});
describe("a model that is looked for", () => {
  const model = { name: "heron", track: "reinvent_2018", tags: ["fast"] };
  const titleOf = (track: string) => (track === "reinvent_2018" ? "Las Vegas 2018" : track);

  it.each(["", "HER", "vegas heron", "reinvent", " fast  2018"])("is found by its name, track or tag: %j", (query) => {
    expect(isFound(model, query, titleOf)).toBe(true);
  });

  it("is not found where one word is missing", () => {
    expect(isFound(model, "heron slow", titleOf)).toBe(false);
  });
});

it("a map of attention was made on perception where the policy sees nothing else", () => {
  expect(lookedAt({ settings: { network: "PERCEPTION" } })).toBe("saliency_how_told");
  expect(lookedAt({ settings: { network: "" } })).toBe("saliency_how");
});
