import { describe, expect, it } from "vitest";
import type { FinalPage } from "./api";
import { roundName, roundsOf, veiled } from "./duels";

const racer = (seed: number | null, source: number | null = null) => ({ seed, source, score: 9, completion: 1 });
const page: FinalPage = {
  race: 1,
  form: "bracket",
  best: 3,
  qualifying: 2,
  qualifying_title: "Q",
  is_qualified: true,
  state: "done",
  error: null,
  finalists: [1, 2, 3].map((seed) => ({ seed, name: `n${seed}`, model: "m", place: seed, is_me: false })),
  duels: [
    { number: 0, round: 0, is_for_third: false, winner: 2, racers: [racer(2), racer(3)] },
    { number: 1, round: 1, is_for_third: false, winner: 1, racers: [racer(1), racer(2, 0)] },
  ],
};

describe("a final that is shown duel by duel", () => {
  it("tells nothing before it was shown", () => {
    const before = veiled(page, new Set());
    expect(before.duels.map((duel) => duel.winner)).toEqual([null, null]);
    expect(before.duels[0]!.racers).toEqual([
      { seed: 2, source: null, score: null, completion: null },
      { seed: 3, source: null, score: null, completion: null },
    ]);
    expect(before.duels[1]!.racers.map((one) => one.seed)).toEqual([1, null]);
    expect(before.finalists.map((one) => one.place)).toEqual([null, null, null]);
  });

  it("tells who goes on, and places at the end only", () => {
    const between = veiled(page, new Set([0]));
    expect(between.duels.map((duel) => duel.winner)).toEqual([2, null]);
    expect(between.duels[1]!.racers.map((one) => one.seed)).toEqual([1, 2]);
    expect(between.finalists[0]!.place).toBeNull();
    expect(veiled(page, new Set([0, 1]))).toEqual(page);
  });

  it("calls rounds by who is left", () => {
    expect(roundsOf(page.duels).map((round) => round.length)).toEqual([1, 1]);
    expect([0, 1].map((round) => roundName(page, round))).toEqual([["final_semi"], ["final_final"]]);
    expect(roundName({ ...page, form: "head-to-head" }, 1)).toEqual(["final_round", { number: 2 }]);
  });
});
