import { describe, expect, it } from "vitest";
import { draw, mirror, oval, resize, reverse, simplify, turn, type ControlPoint } from "../src/lib/sketch";

const ring = (count: number, radius: number, width = 0.8): ControlPoint[] =>
  Array.from({ length: count }, (_, i) => ({
    x: radius * Math.cos((2 * Math.PI * i) / count),
    y: radius * Math.sin((2 * Math.PI * i) / count),
    width,
  }));

describe("draw", () => {
  it("draws a circle through points on one, as the server does", () => {
    const road = draw({ points: ring(12, 3), is_closed: true })!;
    for (const [x, y] of road.center) expect(Math.abs(Math.hypot(x!, y!) - 3)).toBeLessThan(0.003);
    expect(road.length).toBeCloseTo(2 * Math.PI * 3, 1);
    for (const [x, y] of road.left) expect(Math.abs(Math.hypot(x!, y!) - 2.6)).toBeLessThan(0.01);
    for (const [x, y] of road.right) expect(Math.abs(Math.hypot(x!, y!) - 3.4)).toBeLessThan(0.01);
  });
  it("ends an open road at its last point", () => {
    const road = draw({
      points: [
        { x: 0, y: 0, width: 1 },
        { x: 3, y: 1, width: 1 },
        { x: 6, y: 0, width: 1 },
      ],
      is_closed: false,
    })!;
    expect(road.center[0]).toEqual([0, 0]);
    expect(road.center.at(-1)![0]).toBeCloseTo(6);
  });
  it("draws nothing from too little", () => {
    expect(draw({ points: ring(2, 1), is_closed: true })).toBeUndefined();
    expect(draw({ points: [...ring(3, 1), ring(3, 1)[2]!], is_closed: true })).toBeUndefined();
  });
});

describe("what one does to points", () => {
  const points = oval();
  const lengthOf = (changed: ControlPoint[]) => draw({ points: changed, is_closed: true })!.length;
  it("keeps the length when mirrored, turned or reversed", () => {
    const length = lengthOf(points);
    expect(lengthOf(mirror(points))).toBeCloseTo(length, 1);
    expect(lengthOf(turn(points, 0.3))).toBeCloseTo(length, 1);
    expect(lengthOf(reverse({ points, is_closed: true }))).toBeCloseTo(length, 6);
    expect(lengthOf(resize(points, 2)) / length).toBeCloseTo(2, 1);
  });
  it("keeps the start when reversed, and is undone by doing it again", () => {
    const back = reverse({ points, is_closed: true });
    expect(back[0]).toEqual(points[0]);
    expect(reverse({ points: back, is_closed: true })).toEqual(points);
    expect(mirror(mirror(points))).toEqual(points);
  });
  it("finds few points in a drawn line", () => {
    const line = Array.from({ length: 400 }, (_, i) => [5 * Math.cos(i / 64), 3 * Math.sin(i / 64)]);
    const found = simplify(line, 0.9);
    expect(found.length).toBeGreaterThan(6);
    expect(found.length).toBeLessThan(40);
    expect(lengthOf(found)).toBeGreaterThan(24);
  });
});
