import { describe, expect, it } from "vitest";
import { chartSvg, ticks } from "../src/lib/chartsvg";
import { endingOf } from "../src/lib/endings";
import {
  alongLap,
  before,
  byPace,
  cornerReport,
  interpolate,
  PLACES,
  poseAt,
  timeDelta,
  type EvaluationLaps,
  drives,
  type LapTrace,
} from "../src/lib/laps";
import { fileName, toCsv } from "../src/lib/save";

/** A lap along a straight of so many metres at a constant speed. */
function lap(number: number, speed: number, share = 1, length = 10): LapTrace {
  const steps = Math.round((share * length) / speed / 0.1);
  const row = (make: (step: number) => number) => Array.from({ length: steps + 1 }, (_, step) => make(step));
  const done = share === 1;
  return {
    number,
    status: done ? "lap_complete" : "off_track",
    is_complete: done,
    seconds: (share * length) / speed,
    penalty_seconds: 0,
    start: 0,
    time: row((step) => step * 0.1),
    share: row((step) => (step * 0.1 * speed) / length),
    x: row((step) => step * 0.1 * speed),
    y: row(() => 0),
    heading: row(() => 0),
    speed: row(() => speed),
    throttle: row(() => speed),
    steering: row(() => 0),
    puts: [],
    objects: [],
    reward: row(() => 1),
    passages: [
      { seconds: 5 / speed, entry_speed: speed, slowest: speed, exit_speed: speed },
      done ? { seconds: 5 / speed + 0.1, entry_speed: speed, slowest: speed, exit_speed: speed } : null,
    ],
  };
}

describe("laps with a mistake", () => {
  const crashed: LapTrace = { ...lap(1, 1), puts: [5] };
  crashed.y = crashed.y.map((_, row) => (row < 5 ? 0 : 0.5));
  crashed.reward = crashed.reward.map((_, row) => (row === 5 ? null : row));

  it("are drawn without a line to where the car was put", () => {
    expect(drives(crashed)).toEqual([
      [0, 5],
      [5, crashed.x.length],
    ]);
    expect(poseAt(crashed, 0.45).y).toBe(0); // it does not glide there
    expect(poseAt(crashed, 0.5).y).toBe(0.5);
  });

  it("have no reward where the function is not asked", () => {
    const along = alongLap(crashed, crashed.reward);
    expect(along[0]).toBe(0);
    expect(along.every((value) => value === null || Number.isFinite(value))).toBe(true);
    expect(
      alongLap(
        crashed,
        crashed.reward.map(() => null),
      ).every((value) => value === null),
    ).toBe(true);
  });
});

describe("laps", () => {
  const [fast, slow, part] = [lap(1, 2), lap(2, 1), lap(3, 4, 0.5)];

  it("are looked up by what never falls", () => {
    expect([before([0, 1, 1, 3], 1), before([0, 1, 1, 3], 2), before([0, 1], -1), before([0, 1], 9)]).toEqual([
      2, 2, 0, 1,
    ]);
    expect(interpolate(0.25, [0, 1], [10, 20])).toBeCloseTo(12.5);
    expect(interpolate(5, [0, 1], [10, 20])).toBe(20);
  });
  it("have a car at every moment, which waits at the end", () => {
    expect(poseAt(fast, 1.05).x).toBeCloseTo(2.1 - 0.14);
    expect(poseAt(fast, 99).x).toBeCloseTo(10 - 0.14);
    expect(poseAt(fast, 2.5).share).toBeCloseTo(0.5);
  });
  it("do not glide where a car was put somewhere else", () => {
    const jumped = { ...fast, puts: [11], x: fast.x.map((x, index) => (index > 10 ? x + 5 : x)) };
    expect(poseAt(jumped, 1.05).x).toBeCloseTo(2 - 0.14);
  });
  it("lie on one axis, up to where they ended", () => {
    const along = alongLap(part, part.speed);
    expect(along.length).toBe(PLACES);
    expect(along[10]).toBeCloseTo(4);
    expect(along.at(-1)).toBeNull();
  });
  it("lose time place by place", () => {
    const delta = timeDelta(slow, fast);
    expect(delta[0]).toBeCloseTo(0);
    expect(delta.at(-1)).toBeCloseTo(5);
    expect(timeDelta(part, fast).at(-1)).toBeNull();
  });
  it("are ordered by pace, the unfinished last", () => {
    expect(byPace([part, slow, fast]).map((found) => found.number)).toEqual([1, 2, 3]);
  });
  it("tell where time is lost", () => {
    const all = {
      track: "",
      length: 10,
      is_reversed: false,
      sectors: [1, 2].map((number) => ({ number, start: 0, end: 5, apex: 2, turn: 1 })),
      laps: [fast, slow, part],
    } as EvaluationLaps;
    const report = cornerReport(all, slow);
    expect(report[0]!.lost).toBeCloseTo(5 - 1.25);
    expect(report[1]!.lost).toBeCloseTo(2.5);
    expect(cornerReport(all, part)[1]!.lost).toBeNull();
  });
});

describe("endings", () => {
  it("are known in both spellings", () => {
    expect(["Lap complete", "lap_complete", "Time Up", "off_track"].map(endingOf)).toEqual([
      "end_lap_complete",
      "end_lap_complete",
      "end_time_up",
      "end_off_track",
    ]);
    expect(endingOf("Park")).toBeUndefined();
  });
});

describe("files", () => {
  it("quote what has to be quoted, and no formula begins", () => {
    expect(
      toCsv([
        { label: "a,b", values: [1, null, 0.5] },
        { label: "=x", values: ['say "hi"', "@b"] },
      ]),
    ).toBe('"a,b",\'=x\n1,"say ""hi"""\n,\'@b\n0.5,\n');
    expect(toCsv([])).toBe("\n");
  });
  it("have names that every system takes", () => {
    expect([fileName("Speed, m/s"), fileName("../.."), fileName("Länge")]).toEqual(["speed-m-s", "chart", "länge"]);
  });
  it("draw a chart as a picture of its own", () => {
    const svg = chartSvg({
      title: "<b>",
      x: [0, 1, 2],
      lines: [{ label: "a", values: [1, null, 3], color: "red" }],
      xLabel: "m",
      ink: "#000",
      quiet: "#555",
      grid: "#ddd",
      card: "#fff",
    });
    expect(svg).toContain("&#60;b&#62;");
    expect(svg.match(/stroke="red"/g)!.length).toBe(1);
    expect(ticks(0, 1, 5)).toEqual([0, 0.2, 0.4, 0.6, 0.8, 1]);
    expect(ticks(2, 2)).toEqual([2]);
  });
  it("begins a band no earlier than its points", () => {
    const band = { number: 1, color: "gray", label: "" };
    const svg = chartSvg({
      title: "",
      x: [5, 10],
      lines: [],
      xLabel: "",
      bands: [
        { ...band, from: 0, to: 7.5 },
        { ...band, from: 7.5, to: 20 },
        { ...band, from: 0, to: 4 },
      ],
      ink: "#000",
      quiet: "#555",
      grid: "#ddd",
      card: "#fff",
    });
    const bands = [...svg.matchAll(/x="([\d.]+)" y="40" width="([\d.]+)"/g)].map((found) => found.slice(1).map(Number));
    expect(bands).toEqual([
      [70, 435],
      [505, 435],
    ]);
  });
  it("counts in whole numbers, and marks what was best", () => {
    expect(ticks(0, 3, 8)).toContain(0.5);
    expect(ticks(0, 3, 8, true)).toEqual([0, 1, 2, 3]);
    expect(ticks(0, 40, 8, true)).toEqual([0, 5, 10, 15, 20, 25, 30, 35, 40]);
    const svg = chartSvg({
      title: "",
      x: [0, 1],
      lines: [],
      xLabel: "",
      marks: [1],
      mark: "green",
      ink: "#000",
      quiet: "#555",
      grid: "#ddd",
      card: "#fff",
    });
    expect(svg).toContain('fill="green">★</text>');
  });
});
