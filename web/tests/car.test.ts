import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { carGeometry } from "../src/scene/car";
import { roadGeometry } from "../src/scene/ground";

const corners = (geometry: ReturnType<typeof carGeometry>) => {
  const [positions, index] = [geometry.getAttribute("position"), geometry.getIndex()];
  return Array.from({ length: index?.count ?? positions.count }, (_, corner) =>
    new Vector3().fromBufferAttribute(positions, index?.getX(corner) ?? corner),
  );
};

/** Twice the area of each triangle, along its normal. */
const areas = (geometry: ReturnType<typeof carGeometry>) => {
  const found: [Vector3, Vector3][] = [];
  const all = corners(geometry);
  for (let first = 0; first < all.length; first += 3) {
    const [a, b, c] = [all[first]!, all[first + 1]!, all[first + 2]!];
    found.push([a.clone().add(b).add(c).divideScalar(3), b.clone().sub(a).cross(c.clone().sub(a))]);
  }
  return found;
};

describe("a car", () => {
  it("shows its outer faces on every side", () => {
    const faces = areas(carGeometry());
    for (const side of [new Vector3(1, 0, 0), new Vector3(-1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, -1, 0)]) {
      const reach = Math.max(...faces.map(([middle]) => middle.dot(side)));
      const outermost = faces.filter(([middle]) => middle.dot(side) > 0.95 * reach);
      for (const [, normal] of outermost) expect(normal.dot(side)).toBeGreaterThan(0);
    }
  });
  it("is small enough for 64 of them without a GPU", () => {
    expect(areas(carGeometry()).length).toBeLessThan(150);
  });
});

describe("a road", () => {
  const ring = (radius: number, turn: number) =>
    Array.from({ length: 40 }, (_, point) => [
      radius * Math.cos((turn * point * Math.PI) / 20),
      radius * Math.sin((turn * point * Math.PI) / 20),
    ]);
  it.each([1, -1])("is seen from above, whichever way it turns (%i)", (turn) => {
    const road = roadGeometry({
      inner: ring(3, turn),
      outer: ring(4, turn),
      center: ring(3.5, turn),
      is_closed: true,
    } as Parameters<typeof roadGeometry>[0]);
    const lying = areas(road).filter(([middle]) => middle.z > 0.001 && middle.z < 0.02);
    expect(lying.length).toBeGreaterThan(160);
    for (const [, normal] of lying) expect(normal.z).toBeGreaterThan(-1e-12);
  });
});
