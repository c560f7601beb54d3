/** What lies around the road: a mown field, trees that stand clear of it, and hills on the horizon. */
import * as three from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { painted, paintFaces } from "./paint";

/** Colours of the day, or of the night. */
export interface Palette {
  grass: [number, number];
  leaves: [number, number];
  bark: number;
  hills: number;
  horizon: number;
  zenith: number;
}

export const DAY: Palette = {
  ...{ grass: [0x86a37e, 0x7f9d77], leaves: [0x4f7d52, 0x658d55], bark: 0x6a5442 },
  ...{ hills: 0x8fa7a0, horizon: 0xdfe6ea, zenith: 0x9fc3e0 },
};
export const NIGHT: Palette = {
  ...{ grass: [0x4d6350, 0x485e4b], leaves: [0x2f4c37, 0x3a5638], bark: 0x3a3029 },
  ...{ hills: 0x27333c, horizon: 0x11161c, zenith: 0x060a12 },
};

const STRIPS = 96; // mown ones, across the field
const ROWS = 16; // pieces of a strip
const CLEAR = 0.75; // m between a tree and the road
const TREES = 70; // at most
const GOLDEN = Math.PI * (3 - Math.sqrt(5)); // rad, spreads them evenly without a pattern

/** Strips of two greens, cut across, as the haze is worked out at corners. */
function field(radius: number, [one, other]: Palette["grass"]): three.BufferGeometry {
  const strip = (2 * radius) / STRIPS;
  const pieces = Array.from({ length: STRIPS }, (_, index) => {
    const piece = new three.PlaneGeometry(strip, 2 * radius, 1, ROWS);
    return paintFaces(piece.translate((index + 0.5) * strip - radius, 0, 0), index % 2 ? one : other);
  });
  return mergeGeometries(pieces);
}

/** Where trees stand: around the middle, and nowhere near the road. */
export function treePlaces(edges: readonly (readonly [number, number])[], size: number): [number, number][] {
  const places: [number, number][] = [];
  for (let index = 1; index < 4 * TREES && places.length < TREES; index++) {
    const distance = 0.85 * size * Math.sqrt(index / (2.4 * TREES));
    const [x, y] = [distance * Math.cos(index * GOLDEN), distance * Math.sin(index * GOLDEN)];
    if (edges.every(([a, b]) => Math.hypot(a - x, b - y) > CLEAR)) places.push([x, y]);
  }
  return places;
}

function tree([x, y]: [number, number], index: number, { leaves, bark }: Palette): three.BufferGeometry {
  const height = 0.34 + 0.28 * ((index * 0.618) % 1); // m, at the scale of the cars
  const trunk = new three.CylinderGeometry(0.025, 0.035, 0.3 * height, 5, 1, true);
  const crown = new three.ConeGeometry(0.3 * height, 0.85 * height, 7, 1, true);
  crown.translate(0, 0.62 * height, 0);
  trunk.translate(0, 0.15 * height, 0);
  return mergeGeometries([paintFaces(trunk, bark), paintFaces(crown, leaves[index % 2]!)])
    .rotateX(Math.PI / 2)
    .rotateZ(index)
    .translate(x, y, 0);
}

/** A low ridge all around, of waves that close. */
function hills(radius: number, color: number): three.BufferGeometry {
  const parts = 96;
  const tint = new three.Color(color).toArray();
  const ridge = (part: number) => {
    const angle = (2 * Math.PI * part) / parts;
    const height = 0.06 + 0.02 * Math.sin(3 * angle + 1) + 0.015 * Math.sin(7 * angle) + 0.008 * Math.sin(17 * angle);
    return { x: radius * Math.cos(angle), y: radius * Math.sin(angle), z: radius * height };
  };
  const positions: number[] = [];
  for (let part = 0; part < parts; part++) {
    const [a, b] = [ridge(part), ridge(part + 1)];
    positions.push(a.x, a.y, 0, a.x, a.y, a.z, b.x, b.y, b.z, a.x, a.y, 0, b.x, b.y, b.z, b.x, b.y, 0);
  }
  const geometry = painted(positions, Array.from({ length: positions.length / 3 }, () => tint).flat());
  geometry.computeVertexNormals();
  geometry.setIndex(Array.from({ length: positions.length / 3 }, (_, corner) => corner));
  return geometry;
}

/** All of it around the origin; `size` is that of the road, `edges` its border's points. */
export function landscapeGeometry(
  size: number,
  edges: readonly (readonly [number, number])[],
  palette: Palette,
): three.BufferGeometry {
  const radius = size * 5 + 10;
  return mergeGeometries([
    ...treePlaces(edges, size).map((place, index) => tree(place, index, palette)),
    hills(0.9 * radius, palette.hills),
    field(radius, palette.grass),
  ]);
}

/** The sky as a dome that is seen from inside, from the horizon's colour to the zenith's. */
export function skyGeometry(radius: number, { horizon, zenith }: Palette): three.BufferGeometry {
  const dome = new three.SphereGeometry(radius, 16, 8, 0, 2 * Math.PI, 0, Math.PI / 2 + 0.1).rotateX(Math.PI / 2);
  const [low, high] = [new three.Color(horizon), new three.Color(zenith)];
  const places = dome.getAttribute("position");
  const colors = Array.from({ length: places.count }, (_, corner) =>
    low
      .clone()
      .lerp(high, Math.min(Math.max((1.6 * places.getZ(corner)) / radius, 0), 1))
      .toArray(),
  );
  dome.setAttribute("color", new three.Float32BufferAttribute(colors.flat(), 3));
  return dome;
}
