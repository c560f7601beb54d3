import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, type TrackFacts } from "../src/api/client";

describe("the title of a track", () => {
  beforeEach(() => vi.resetModules());
  afterEach(() => void vi.restoreAllMocks());
  const fresh = async () => (await import("../src/lib/tracktitles.svelte")).titleOf;
  const answers = async (found: Promise<TrackFacts[]>) => {
    const { api: fetched } = await import("../src/api/client"); // the one that the fresh module knows
    for (const one of new Set([api, fetched])) vi.spyOn(one, "tracks").mockReturnValue(found);
  };

  it("is never a name that jumps once titles are known", async () => {
    await answers(Promise.resolve([{ name: "oval", title: "Oval" }] as TrackFacts[]));
    const titleOf = await fresh();
    expect([titleOf("oval"), titleOf("generated:3")]).toEqual(["…", "generator, seed 3"]);
    await vi.waitFor(() => expect(titleOf("oval")).toBe("Oval"), 30_000);
    expect(titleOf("gone")).toBe("gone");
  });

  it("is the name where titles cannot be had", async () => {
    const refused = Promise.reject(new Error("no"));
    refused.catch(() => undefined);
    await answers(refused);
    const titleOf = await fresh();
    titleOf("oval");
    await vi.waitFor(() => expect(titleOf("oval")).toBe("oval"), 30_000);
  });
});
