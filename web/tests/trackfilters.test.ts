import { describe, expect, it } from "vitest";
import { difficulty, fits } from "../src/lib/trackfilters";

const oval = { length: 16.8, mean_width: 0.9, min_radius: 1.59, corners: 2, direction: "counter-clockwise" };
const needle = { length: 27.1, mean_width: 0.6, min_radius: 0.73, corners: 12, direction: "counter-clockwise" };
const lakeside = { length: 35.6, mean_width: 1, min_radius: 1.49, corners: 9, direction: "clockwise" };

describe("tracks", () => {
  it("are as hard as their bends are tight and many", () => {
    expect([oval, lakeside, needle].map(difficulty)).toEqual(["track_easy", "track_medium", "track_hard"]);
    expect(difficulty({ ...oval, min_radius: null, corners: 0 })).toBe("track_easy");
  });
  it("are chosen by one trait of each group", () => {
    const names = (...chosen: Parameters<typeof fits>[1]) =>
      [oval, needle, lakeside].filter((track) => fits(track, chosen)).map((track) => track.length);
    expect(names()).toHaveLength(3);
    expect(names("tracks_short", "long")).toHaveLength(3);
    expect(names("long", "tracks_right")).toEqual([35.6]);
    expect(names("narrow", "tracks_right")).toEqual([]);
  });
});
