import { describe, expect, it } from "vitest";
import { paceOf, racesOf, ranksOf } from "./pace";

const result = (race: number, gap: number | null) => ({ race, title: `r${race}`, place: 1, points: 0, gap });

describe("the pace over a season", () => {
  it("has a point for each timed race, nearer to the top the closer to the first", () => {
    const pace = paceOf([result(1, 0.25), result(2, null), result(3, 0), result(4, 5)]);
    expect(pace.map((one) => one.title)).toEqual(["r1", "r3", "r4"]);
    expect(pace.map((one) => one.share)).toEqual([0.5, 0, 1]);
    expect(pace[0]!.percent).toBe(25);
  });

  it("knows the races of all, each once", () => {
    const row = { name: "a", points: 0, races: 0, wins: 0, is_me: false };
    const rows = [
      { ...row, results: [result(4, 0), result(2, 0)] },
      { ...row, results: [result(3, 0), result(2, 1)] },
    ];
    expect(racesOf(rows).map((one) => one.race)).toEqual([2, 3, 4]);
  });

  it("ranks who is level alike, and who comes next after all of them", () => {
    const [one, other, none] = [
      { points: 43, wins: 1 },
      { points: 43, wins: 0 },
      { points: 0, wins: 0 },
    ];
    expect(ranksOf([one, one, other, none, none, none])).toEqual([1, 1, 3, 4, 4, 4]);
    expect(ranksOf([])).toEqual([]);
  });
});
