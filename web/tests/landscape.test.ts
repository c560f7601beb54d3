import type { BufferGeometry } from "three";
import { describe, expect, it } from "vitest";
import { gantryGeometry } from "../src/scene/gantry";
import { kerbGeometry } from "../src/scene/kerbs";
import { DAY, landscapeGeometry, NIGHT, treePlaces } from "../src/scene/landscape";

type Track = Parameters<typeof kerbGeometry>[0];

/** Two straights of 4 m and two half circles, driven to the left or to the right. */
function stadium(turn: 1 | -1, radius: number, width = 0.8): Track {
  const line = (side: number) => {
    const points: number[][] = [];
    const r = radius + side;
    for (let x = -2; x < 2; x += 0.1) points.push([x, -r]);
    for (let a = -Math.PI / 2; a < Math.PI / 2; a += 0.05) points.push([2 + r * Math.cos(a), r * Math.sin(a)]);
    for (let x = 2; x > -2; x -= 0.1) points.push([x, r]);
    for (let a = Math.PI / 2; a < 1.5 * Math.PI; a += 0.05) points.push([-2 + r * Math.cos(a), r * Math.sin(a)]);
    return turn > 0 ? points : points.reverse();
  };
  const lines = { center: line(0), inner: line(-width / 2), outer: line(width / 2) };
  return { name: "stadium", length: 8 + 2 * Math.PI * radius, is_closed: true, ...lines };
}

const corners = (geometry: BufferGeometry) => {
  const places = geometry.getAttribute("position");
  return Array.from({ length: places.count }, (_, at) => [places.getX(at), places.getY(at), places.getZ(at)] as const);
};

describe("kerbs", () => {
  it.each([1, -1] as const)("lie beyond the inner line of bends, and nowhere else (%i)", (turn) => {
    const kerbs = corners(kerbGeometry(stadium(turn, 1.5), 0.002)!);
    expect(kerbs.length).toBeGreaterThan(100);
    for (const [x, y] of kerbs) {
      const far = Math.hypot(x - Math.sign(x) * 2, y);
      if (Math.abs(x) > 2.05) expect(far).toBeLessThan(1.11); // the inner line is 1.1 m from the middle of its bend
      if (Math.abs(x) > 2.05) expect(far).toBeGreaterThan(1.0);
      expect(Math.abs(x)).toBeGreaterThan(1.4); // the straight has none
    }
  });
  it("are not where a road hardly bends", () => {
    expect(kerbGeometry(stadium(1, 6), 0.002)).toBeNull();
  });
});

describe("a gantry", () => {
  it("leaves the road free", () => {
    for (const [x, y, z] of corners(gantryGeometry(stadium(1, 1.5), 0.01))) {
      expect(Math.abs(x + 2)).toBeLessThan(0.1); // where the lap begins
      if (y > -1.9 && y < -1.1) expect(z < 0.011 || z > 0.55).toBe(true);
    }
  });
});

describe("a landscape", () => {
  const track = stadium(1, 1.5);
  const edges = [...track.inner, ...track.outer].map(([x, y]) => [x!, y!] as const);

  it("has trees, none of them near the road", () => {
    const places = treePlaces(edges, 8);
    expect(places.length).toBeGreaterThan(20);
    for (const [x, y] of places) for (const [a, b] of edges) expect(Math.hypot(a - x, b - y)).toBeGreaterThan(0.7);
    expect(treePlaces(edges, 8)).toEqual(places);
  });
  it("is the same by night, but for its colours", () => {
    const [day, night] = [DAY, NIGHT].map((palette) => landscapeGeometry(8, edges, palette));
    expect(corners(day!)).toEqual(corners(night!));
    expect(day!.getAttribute("color").array).not.toEqual(night!.getAttribute("color").array);
    expect(day!.getIndex()!.count / 3).toBeLessThan(5000);
  });
});
