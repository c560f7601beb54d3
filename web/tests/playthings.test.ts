import { describe, expect, it } from "vitest";
import { chances, choose, newPlayer, pull } from "../src/course/playthings/bandit";
import * as world from "../src/course/playthings/grid";
import { lot } from "../src/course/playthings/lot";
import { advantages, clipped, pulls } from "../src/course/playthings/objectives";

describe("by lot", () => {
  it("is the same for the same seed, even, and from 0 to 1", () => {
    const draw = lot(7);
    const again = lot(7);
    const drawn = Array.from({ length: 20_000 }, draw);
    expect(drawn.slice(0, 5)).toEqual(Array.from({ length: 5 }, again));
    expect(lot(8)()).not.toBe(drawn[0]);
    expect(Math.min(...drawn)).toBeGreaterThanOrEqual(0);
    expect(Math.max(...drawn)).toBeLessThan(1);
    expect(drawn.reduce((sum, one) => sum + one, 0) / drawn.length).toBeCloseTo(0.5, 2);
  });
});

describe("the grid", () => {
  const at = (row: number, column: number) => row * world.COLUMNS + column;
  it("has walls, borders, a goal and a price", () => {
    expect(world.outcome(at(0, 2), 1)).toEqual({ after: at(0, 2), reward: -0.02, isOver: false }); // wall
    expect(world.outcome(at(0, 0), 0).after).toBe(at(0, 0)); // border
    expect(world.outcome(at(1, 5), 3).after).toBe(at(1, 4));
    expect(world.outcome(at(2, 5), 0)).toEqual({ after: at(1, 5), reward: -1, isOver: true });
    expect(world.outcome(at(0, 4), 1).after).toBe(at(0, 4) + 1);
  });
  it("is solved: Bellman's equation holds everywhere, and beside the goal it is known", () => {
    const truth = world.solve(0.9);
    for (let one = 0; one < world.STATES; one++)
      for (let action = 0; action < 4; action++) {
        if (world.isEnd(one) || world.signOf(one) === "#") continue;
        const { after, reward, isOver } = world.outcome(one, action);
        const wanted = reward + (isOver ? 0 : 0.9 * Math.max(...truth[after]!));
        expect(truth[one]![action]).toBeCloseTo(wanted, 9);
      }
    const goal = world.MAP.join("").indexOf("G");
    expect(Math.max(...truth[goal + world.COLUMNS]!)).toBe(0); // a pit lies below the goal
    expect(truth.some((row) => Math.max(...row) === 1)).toBe(true);
  });
  it("is learned as it is solved, where all is tried", () => {
    const table = world.emptyTable();
    const draw = lot(3);
    let state = world.START;
    for (let i = 0; i < 80_000; i++)
      state = world.learn(table, state, { epsilon: 1, alpha: 0.5, gamma: 0.9 }, draw).after;
    const truth = world.solve(0.9);
    for (let one = 0; one < world.STATES; one++)
      for (let action = 0; action < 4; action++) expect(table[one]![action]).toBeCloseTo(truth[one]![action]!, 2);
  });
  it("learns nothing without a step size", () => {
    const table = world.emptyTable();
    const draw = lot(3);
    for (let i = 0, state = world.START; i < 500; i++)
      state = world.learn(table, state, { epsilon: 0.5, alpha: 0, gamma: 0.9 }, draw).after;
    expect(table).toEqual(world.emptyTable());
  });
});

describe("the bandit", () => {
  const play = (epsilon: number, seed: number, count: number) => {
    const draw = lot(seed);
    const winning = chances(5, draw);
    const player = newPlayer(5);
    for (let i = 0; i < count; i++) pull(player, choose(player, epsilon, draw), winning, draw);
    return { player, winning };
  };
  it("keeps means, counts and regret", () => {
    const player = newPlayer(2);
    const draws = [0.1, 0.9, 0.1];
    for (const arm of [0, 0, 1]) pull(player, arm, [0.5, 0.8], () => draws.shift()!);
    expect(player.values).toEqual([0.5, 1]);
    expect(player.pulls).toEqual([2, 1]);
    expect(player.regret.map((one) => one.toFixed(1))).toEqual(["0.3", "0.6", "0.6"]);
  });
  it("comes to the true chances", () => {
    const { player, winning } = play(1, 5, 50_000);
    player.values.forEach((value, arm) => expect(value).toBeCloseTo(winning[arm]!, 1));
  });
  it("loses less with some exploring than with all of it or none, on average", () => {
    const loss = (epsilon: number) =>
      [...Array(40).keys()].reduce((sum, seed) => sum + play(epsilon, seed, 600).player.regret.at(-1)!, 0);
    expect(loss(0.1)).toBeLessThan(loss(0));
    expect(loss(0.1)).toBeLessThan(loss(1) / 2);
  });
});

describe("objectives", () => {
  it("GAE is the sum that it is said to be", () => {
    const surprises = [1, -2, 0.5, 3];
    for (const [gamma, lambda] of [
      [0.9, 0.8],
      [1, 1],
      [0.99, 0],
    ] as const)
      advantages(surprises, gamma, lambda).forEach((found, t) =>
        expect(found).toBeCloseTo(
          surprises.slice(t).reduce((sum, delta, later) => sum + (gamma * lambda) ** later * delta, 0),
          12,
        ),
      );
    expect(advantages(surprises, 0.99, 0)).toEqual(surprises);
    expect(advantages([], 1, 1)).toEqual([]);
  });
  it("the clip is flat where nothing pulls, and nowhere else", () => {
    const slope = (ratio: number, advantage: number) =>
      (clipped(ratio + 1e-6, advantage, 0.2) - clipped(ratio - 1e-6, advantage, 0.2)) / 2e-6;
    for (const advantage of [-1, 1])
      for (let ratio = 0.05; ratio < 2; ratio += 0.1)
        expect(Math.abs(slope(ratio, advantage)) > 0.5).toBe(pulls(ratio, advantage, 0.2));
    expect(clipped(1.5, 1, 0.2)).toBeCloseTo(1.2);
    expect(clipped(0.5, 1, 0.2)).toBeCloseTo(0.5);
    expect(clipped(1.5, -1, 0.2)).toBeCloseTo(-1.5);
    expect(clipped(0.5, -1, 0.2)).toBeCloseTo(-0.8);
    expect(pulls(1, 0, 0.2)).toBe(false);
  });
});
