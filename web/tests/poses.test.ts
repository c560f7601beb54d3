import { describe, expect, it } from "vitest";
import { scale, span } from "../src/lib/colors";
import { viewBox } from "../src/lib/geometry";
import { clock, percent, seconds } from "../src/lib/numbers";
import { between, halfway, turn, type Look } from "../src/scene/poses";
import { de } from "../src/i18n/de";
import { en } from "../src/i18n/en";

const look = (poses: number[][], steps: number[]): Look => ({
  step: 0,
  poses,
  steps,
  policy: [],
  is_discrete: true,
});

describe("cars between two looks", () => {
  const before = look(
    [
      [0, 0, 3100, 0, 0, 0],
      [0, 0, 0, 0, 0, 0],
      [0, 0, 0, 0, 0, 0],
    ],
    [5, 90, 5],
  );
  const now = look(
    [
      [1000, 0, -3100, 0, 0, 0],
      [1000, 0, 0, 0, 0, 0],
      [9000, 0, 0, 0, 0, 0],
    ],
    [6, 2, 6],
  );
  const [smooth, restarted, far] = between(before, now, 0.5);

  it("drive on smoothly, the short way round", () => {
    expect(smooth!.x).toBeCloseTo(0.5);
    expect(Math.abs(smooth!.heading)).toBeGreaterThan(3.1);
  });
  it("jump when they were put at a new start, or are far away", () => {
    expect(restarted!.x).toBe(1);
    expect(far!.x).toBe(9);
  });
  it("are where they are when nothing came before", () => {
    expect(between(undefined, now, 0.3)[0]!.x).toBe(1);
  });
  it("go on from where they are when the next look comes early", () => {
    const next = look(
      [
        [2000, 0, -3100, 0, 0, 0],
        [2000, 0, 0, 0, 0, 0],
        [9000, 0, 0, 0, 0, 0],
      ],
      [7, 3, 7],
    );
    const here = halfway(before, now, 0.5);
    expect(between(here, next, 0)[0]!.x).toBeCloseTo(0.5);
    expect(between(here, next, 0.5)[0]!.x).toBeCloseTo(1.25);
    expect(here.steps).toEqual(now.steps);
  });
  it("turn by less than half a turn", () => {
    expect(turn(3, -3)).toBeCloseTo(2 * Math.PI - 6);
  });
});

describe("what is drawn", () => {
  it("has a colour for every number", () => {
    expect(scale(0)).toBe("rgb(68, 1, 84)");
    expect(scale(2)).toBe("rgb(253, 231, 37)");
    expect(scale(Number.NaN)).toBe("rgb(68, 1, 84)");
  });
  it("has a range even when all values are the same, or none is known", () => {
    expect(span([3, 3, null])).toEqual([2.5, 3.5]);
    expect(span([null])).toEqual([0, 1]);
    expect(span([2, 2.1], 0.5)).toEqual([1.8, 2.3]);
    expect(span([2, 4], 0.5)).toEqual([2, 4]);
  });
  it("fits its frame", () => {
    expect(
      viewBox(
        [
          [
            [0, 0],
            [2, 1],
          ],
        ],
        1,
      ),
    ).toBe("-1.000 -2.000 4.000 3.000");
  });
  it("reads well", () => {
    expect([clock(75), clock(3700), clock(null), percent(0.126), seconds(9.3)]).toEqual([
      "1:15",
      "1:01:40",
      "–",
      "13\u00a0%",
      "9.30\u00a0s",
    ]);
  });
});

describe("languages", () => {
  const holes = (text: string) => (text.match(/\{\w+\}/g) ?? []).sort();

  it("have the same keys with the same holes, and no text is empty", () => {
    expect(Object.keys(de).sort()).toEqual(Object.keys(en).sort());
    for (const key of Object.keys(en) as (keyof typeof en)[]) {
      expect(de[key].length).toBeGreaterThan(0);
      expect(holes(de[key])).toEqual(holes(en[key]));
    }
  });
});
