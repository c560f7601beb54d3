import { describe, expect, it } from "vitest";
import { distances, fastestLap, gapAfter, placesOf } from "../src/lib/racelaps";
import { gainsOf, sentenceOf, type PlacedLap, type Sector } from "../src/lib/why";

const LENGTH = 20;
const CORNER: Sector = { number: 4, start: 5, end: 15, apex: 10, turn: 1 };

/** A lap along a circle of LENGTH m, row by row at the speed that a place has, from a place on. */
function drive(speedAt: (place: number) => number, begin = 0, radius = LENGTH / (2 * Math.PI)): PlacedLap {
  const lap: PlacedLap = { place: [], time: [], speed: [], x: [], y: [], puts: [] };
  for (let place = begin, time = 0; place <= begin + LENGTH + 1e-9; place += 0.02) {
    const around = ((place % LENGTH) + LENGTH) % LENGTH;
    lap.place.push(place);
    lap.time.push(time);
    lap.speed.push(speedAt(around));
    lap.x.push(radius * Math.cos((2 * Math.PI * place) / LENGTH));
    lap.y.push(radius * Math.sin((2 * Math.PI * place) / LENGTH));
    time += 0.02 / speedAt(around);
  }
  return lap;
}

/** 3 m/s down to `slow` from `brake` m on, within 1 m, and up again from `go` m on. */
const profile =
  (brake: number, slow = 1, go = 11) =>
  (place: number): number =>
    place < brake
      ? 3
      : place < brake + 1
        ? 3 - (3 - slow) * (place - brake)
        : place < go
          ? slow
          : Math.min(3, slow + 2 * (place - go));

const only = (first: PlacedLap, second: PlacedLap) => {
  const gains = gainsOf(first, second, [CORNER], LENGTH);
  expect(gains).toHaveLength(1);
  return gains[0]!;
};
const took = (lap: PlacedLap) => {
  const at = (place: number) => lap.time[lap.place.findIndex((one) => one >= place - 1e-9)]!;
  return at(15) - at(5);
};

describe("why a lap is faster", () => {
  const usual = drive(profile(7));

  it("is that it brakes later", () => {
    const later = drive(profile(7.4));
    const gain = only(usual, later);
    expect(gain.reason).toBe("brakes");
    expect(gain.amount).toBeCloseTo(0.4, 1);
    expect(gain.seconds).toBeCloseTo(took(usual) - took(later), 2);
    expect(sentenceOf(gain, ["A", "B"])).toEqual(["why_brakes", { who: "B", whom: "A", corner: 4, amount: "0.4" }]);
  });

  it("is told of the faster one, whichever it is", () => {
    const gain = only(drive(profile(7.4)), usual);
    expect(gain.seconds).toBeLessThan(-0.1);
    expect(gain.reason).toBe("brakes");
    expect(sentenceOf(gain, ["A", "B"])[1]["who"]).toBe("A");
  });

  it("is its speed in the middle, its way out, or that it need not brake", () => {
    const middle = only(usual, drive(profile(7, 1.3)));
    expect(middle.reason).toBe("middle");
    expect(middle.amount).toBeCloseTo(0.3, 2);
    const out = only(usual, drive(profile(7, 1, 10.5)));
    expect(out.reason).toBe("accelerates");
    expect(out.amount).toBeCloseTo(0.5, 1);
    expect(
      only(
        usual,
        drive(() => 2.9),
      ).reason,
    ).toBe("lifts");
  });

  it("is a shorter line where the speeds are the same", () => {
    const outside = drive(() => 2);
    const inside = drive(() => 2.2, 0, (0.9 * LENGTH) / (2 * Math.PI));
    inside.speed = inside.speed.map(() => 2);
    const gain = only(outside, inside);
    expect(gain.reason).toBe("way");
    expect(gain.amount).toBeCloseTo(1, 1);
  });

  it("is staying on the road", () => {
    const crashed = { ...drive(profile(6)), puts: [400] }; // 8 m
    expect(only(crashed, usual).reason).toBe("puts");
    expect(only({ ...crashed, puts: [100] }, usual).reason).not.toBe("puts"); // 2 m: before the corner
    // of two that were put back the speeds are of standing, and say nothing of how they drove
    const twice = { ...crashed, puts: [400, 420] };
    const gain = only(twice, { ...usual, puts: [400] });
    expect(sentenceOf(gain, ["A", "B"])).toEqual([
      "why_fewer",
      { who: "B", whom: "A", corner: 4, amount: gain.amount.toFixed(1) },
    ]);
    expect(only(crashed, { ...usual, puts: [400] }).reason).toBe("pace");
  });

  it("does not depend on where the laps began, also within the corner", () => {
    for (const begin of [3, 8, 12]) {
      const gain = only(drive(profile(7), begin), drive(profile(7.4)));
      expect(gain.seconds).toBeCloseTo(took(usual) - took(drive(profile(7.4))), 1);
    }
  });

  it("is not told of a corner that one of them never got through", () => {
    const part = drive(profile(7));
    for (const column of [part.place, part.time, part.speed, part.x, part.y]) column.length = 600; // 12 m
    expect(gainsOf(part, usual, [CORNER], LENGTH)).toEqual([]);
  });
});

describe("a film of several cars", () => {
  const square = [
    [0, 0],
    [5, 0],
    [5, 5],
    [0, 5],
  ];
  const geometry = { name: "square", length: LENGTH, is_closed: true, center: square, inner: [], outer: [] };
  const along = (place: number, isBackward = false): [number, number] => {
    const s = (((isBackward ? -place : place) % LENGTH) + LENGTH) % LENGTH;
    const [side, rest] = [Math.floor(s / 5) % 4, s % 5];
    const from = square[side]!;
    const to = square[(side + 1) % 4]!;
    return [from[0]! + ((to[0]! - from[0]!) * rest) / 5, from[1]! + ((to[1]! - from[1]!) * rest) / 5];
  };
  const car = (step: number, rows: number, laps: number[], begin = 2, isBackward = false) => ({
    entry: 1,
    model: "one",
    trace: Array.from({ length: rows }, (_, row) => [
      ...along(begin + row * step, isBackward).map((metres) => Math.round(1000 * metres)),
      0,
    ]),
    laps,
  });

  it("says how far each is, over laps and in either direction", () => {
    const forward = placesOf({ geometry, is_reversed: false }, car(0.2, 301, []));
    expect(forward[0]).toBeCloseTo(2, 2);
    expect(forward[300]! - forward[0]!).toBeCloseTo(60, 1);
    const backward = placesOf({ geometry, is_reversed: true }, car(0.2, 301, [], 2, true));
    expect(backward[300]! - backward[0]!).toBeCloseTo(60, 1);
  });

  it("says by how much one is behind, as far as both came", () => {
    const [fast, slow] = [car(0.2, 201, []), car(0.1, 201, [])].map((one) =>
      placesOf({ geometry, is_reversed: false }, one),
    ) as [number[], number[]];
    const metres = distances([fast, slow], 5);
    expect(metres[4]).toBeCloseTo(40, 1);
    const gaps = gapAfter(slow, fast, metres);
    expect(gaps[1]).toBeCloseTo((100 - 50) / 15, 1);
    expect(gaps[2]).toBeCloseTo((200 - 100) / 15, 1);
    expect(gaps.slice(3)).toEqual([null, null]);
    expect(gapAfter(fast, fast, metres)).toEqual([0, 0, 0, 0, 0]);
  });

  it("compares the fastest laps, which know where a car was put", () => {
    const one = car(0.2, 221, [110, 210]);
    one.trace[5] = [4600, 0, 0]; // from 2.8 m
    const places = placesOf({ geometry, is_reversed: false }, one);
    const lap = fastestLap(one, places)!;
    expect(lap.time).toHaveLength(101);
    expect(lap.place[0]).toBeCloseTo(24, 1);
    expect(lap.speed[50]).toBeCloseTo(3, 1);
    expect(lap.puts).toEqual([]);
    expect(fastestLap({ ...one, laps: [110] }, places)!.puts).toContain(5);
    expect(fastestLap({ ...one, laps: [] }, places)).toBeUndefined();
  });

  it("knows where a car was put from the border to the middle and stood, which on a narrow road is no leap", () => {
    const [before, after] = [car(0.07, 60, []), car(0.07, 231, [], 6.13)];
    before.trace = before.trace.map(([x, y]) => [x!, y! - 300, 0]);
    const stood = Array.from({ length: 75 }, () => after.trace[0]!);
    const one = { ...before, trace: [...before.trace, ...stood, ...after.trace], laps: [360] };
    const lap = fastestLap(one, placesOf({ geometry, is_reversed: false }, one))!;
    expect(lap.puts).toEqual([60]);
    expect(Math.max(...lap.speed)).toBeCloseTo(0.07 * 15, 1); // and not of the hand that put it
  });
});
