import { describe, expect, it } from "vitest";
import { chances, choose, newPlayer, pull } from "../src/course/playthings/bandit";
import * as world from "../src/course/playthings/grid";
import { entropy, episode, lapOf, newPolicy, softmax } from "../src/course/playthings/lap";
import { lot } from "../src/course/playthings/lot";
import { advantages, clipped, pulls } from "../src/course/playthings/objectives";
import { worth } from "../src/course/playthings/table";
import * as road from "../src/course/playthings/track";

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
    const table = world.newTable();
    const draw = lot(3);
    let state = world.START;
    for (let i = 0; i < 80_000; i++)
      state = world.learn(table, state, { epsilon: 1, alpha: 0.5, gamma: 0.9 }, draw).after;
    const truth = world.solve(0.9);
    for (let one = 0; one < world.STATES; one++)
      for (let action = 0; action < 4; action++) expect(table[one]![action]).toBeCloseTo(truth[one]![action]!, 2);
  });
  it("learns nothing without a step size", () => {
    const table = world.newTable();
    const draw = lot(3);
    for (let i = 0, state = world.START; i < 500; i++)
      state = world.learn(table, state, { epsilon: 0.5, alpha: 0, gamma: 0.9 }, draw).after;
    expect(table).toEqual(world.newTable());
  });
});

describe("the road", () => {
  const off = { after: road.OFF, reward: -1, isOver: true };
  const far = (one: (place: number) => number) =>
    [...Array(road.STATES).keys()].reduce((sum, place) => sum + Math.abs(one(place)), 0) / road.STATES;
  it("is a loop that bends both ways, and as long as it is wide", () => {
    expect(road.shape).toHaveLength(road.LENGTH);
    expect(Math.max(...road.bends)).toBe(1);
    expect(Math.min(...road.bends)).toBeLessThan(-0.1);
    const steps = road.shape.map(({ point }, i) => {
      const next = road.shape[(i + 1) % road.LENGTH]!.point;
      return Math.hypot(next[0] - point[0], next[1] - point[1]);
    });
    expect(Math.max(...steps) / Math.min(...steps)).toBeLessThan(1.1);
  });
  it("goes on by a segment, ends in the grass, and pays at the line", () => {
    const left = road.placeAt(3, 0);
    expect(road.outcomes(left, 0, 0, "line")).toEqual([{ ...off, chance: 1 }]);
    expect(road.outcomes(left, 2, 0, "line")[0]!.after).toBe(road.placeAt(4, 1));
    const [end] = road.outcomes(road.placeAt(road.LENGTH - 1, 2), 1, 0, "line");
    expect(end).toMatchObject({ after: road.placeAt(0, 2), reward: 1, isOver: true });
    expect(road.outcomes(road.placeAt(road.LENGTH - 1, 2), 1, 0, "middle")[0]!.isOver).toBe(false);
  });
  it("carries a car outwards in a bend, as often as it is slippery", () => {
    const sharpest = road.bends.indexOf(1); // to the left, so out is to the right
    const [held, carried] = road.outcomes(road.placeAt(sharpest, 2), 1, 0.4, "line");
    expect(road.laneOf(carried!.after) - road.laneOf(held!.after)).toBe(1);
    expect([held!.chance, carried!.chance]).toEqual([0.6, 0.4]);
    expect(road.outcomes(road.placeAt(sharpest, 4), 1, 0.4, "line")[1]).toMatchObject(off);
  });
  it("is worth γ to the power of the way that is left, where nothing slips", () => {
    const truth = road.solve(0.9, 0, "line");
    for (const segment of [0, 20, 47])
      expect(Math.max(...truth[road.placeAt(segment, 2)]!)).toBeCloseTo(0.9 ** (road.LENGTH - 1 - segment), 9);
    const paid = road.solve(0.9, 0, "middle"); // 0.1 a step for ever
    expect(Math.max(...paid[road.placeAt(7, 2)]!)).toBeCloseTo(1, 3);
  });
  it("is solved: Bellman's equation holds at every place, and nothing comes after an end", () => {
    expect(worth([[5], [7]], { after: 1, reward: 1, isOver: false }, 0.5)).toBe(4.5);
    expect(worth([[5], [7]], { after: 1, reward: 1, isOver: true }, 0.5)).toBe(1);
    for (const pay of ["line", "middle"] as const) {
      const truth = road.solve(0.7, 0.5, pay);
      for (let place = 0; place < road.STATES; place++)
        road.MOVES.forEach((_, action) => {
          const told = road.outcomes(place, action, 0.5, pay);
          const wanted = told.reduce((sum, one) => sum + one.chance * worth(truth, one, 0.7), 0);
          expect(Math.abs(truth[place]![action]! - wanted)).toBeLessThan(1e-6);
        });
    }
  });
  it("is learned as it is solved", () => {
    const table = road.newTable();
    const draw = lot(2);
    const settings = { epsilon: 1, alpha: 0.2, gamma: 0.8 };
    for (let i = 0, place = 0; i < 60_000; i++) place = road.learn(table, place, 0.5, "line", settings, draw).after;
    const truth = road.solve(0.8, 0.5, "line");
    expect(far((place) => Math.max(...table[place]!) - Math.max(...truth[place]!))).toBeLessThan(0.03);
    expect(far((place) => Math.max(...truth[place]!))).toBeGreaterThan(0.1);
  }, 30_000);
});

describe("a policy over a lap", () => {
  const teaching = { alpha: 1.5, gamma: 0.97, beta: 0.02, slip: 0.5 };
  const taught = (more: Partial<typeof teaching>, drives = 1500) => {
    const policy = newPolicy();
    const draw = lot(4);
    for (let i = 0; i < drives; i++) episode(policy, { ...teaching, ...more }, draw);
    return policy;
  };
  it("begins undecided, and loses no car", () => {
    const lap = lapOf(newPolicy(), 0);
    for (const chances of lap.actions) expect(entropy(chances)).toBeCloseTo(Math.log(3), 9);
    const still = newPolicy();
    for (const row of still.preferences) row[1] = 40; // straight on
    expect(lapOf(still, 0).round).toBeCloseTo(1, 9);
    expect(lapOf(still, 1).round).toBeLessThan(0.1);
    const sums = [...Array(road.LENGTH).keys()].map((segment) =>
      lap.there.slice(road.placeAt(segment, 0), road.placeAt(segment + 1, 0)).reduce((sum, one) => sum + one, 0),
    );
    expect(sums[0]).toBe(1);
    sums.slice(1).forEach((sum, i) => expect(sum).toBeLessThanOrEqual(sums[i]! + 1e-12));
    expect(lap.round).toBeLessThanOrEqual(sums.at(-1)!);
  });
  it("gets round once it has learned, and not without a step size", () => {
    expect(lapOf(newPolicy(), 0.5).round).toBeLessThan(0.2);
    expect(lapOf(taught({}), 0.5).round).toBeGreaterThan(0.8);
    const { baseline } = taught({});
    expect(Math.max(...baseline)).toBeLessThanOrEqual(1); // no more than the line pays
    expect(baseline[road.placeAt(road.LENGTH - 2, road.MIDDLE)]).toBeGreaterThan(0.7);
    expect(taught({ alpha: 0 }, 50).preferences).toEqual(newPolicy().preferences);
  });
  it("stays the more open the more entropy weighs", () => {
    expect(lapOf(newPolicy(), 0.5).undecided).toBeCloseTo(1, 9);
    const open = [0, 0.3].map((beta) => lapOf(taught({ beta }), 0.5).undecided);
    expect(open[1]).toBeGreaterThan(open[0]! + 0.3);
  });
  it("follows the slope of log π and of the entropy", () => {
    const preferences = [0.3, -0.2, 0.9];
    const moved = (one: number, by: number) => softmax(preferences.map((h, i) => h + (i === one ? by : 0)));
    const p = softmax(preferences);
    for (let one = 0; one < 3; one++) {
      const slope = (entropy(moved(one, 1e-5)) - entropy(moved(one, -1e-5))) / 2e-5;
      expect(-p[one]! * (Math.log(p[one]!) + entropy(p))).toBeCloseTo(slope, 6);
    }
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
