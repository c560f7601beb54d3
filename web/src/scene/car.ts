/** A small racing car of flat faces: only those that can be seen from above the ground, as 64 of them are drawn at once. */
import * as three from "three";
import { painted } from "./paint";

/** A cut across the car: where along it (m), half its width, its bottom and its top. */
type Cut = [x: number, half: number, bottom: number, top: number];
type Corner = [x: number, y: number, z: number];

const BODY: Cut[] = [
  [0.165, 0.03, 0.03, 0.048],
  [0.1, 0.052, 0.028, 0.072],
  [-0.02, 0.07, 0.028, 0.096],
  [-0.13, 0.074, 0.03, 0.104],
  [-0.155, 0.06, 0.04, 0.094],
];
const GLASS: Cut[] = [
  [0.055, 0.034, 0.07, 0.084],
  [0.0, 0.046, 0.08, 0.134],
  [-0.06, 0.044, 0.09, 0.138],
  [-0.112, 0.032, 0.09, 0.106],
];
const WING: Cut[] = [
  [-0.135, 0.092, 0.14, 0.148],
  [-0.17, 0.092, 0.146, 0.156],
];
const WHEEL = { radius: 0.038, inside: 0.06, outside: 0.102, sides: 8 }; // m
const SHADOW = { length: 0.175, width: 0.112, height: 0.001 }; // m, halves of its length and width

/** The faces of a hull through cuts from the nose to the tail, as seen from outside; nobody sees its bottom. */
function hull(cuts: Cut[]): Corner[][] {
  const corners = cuts.map(([x, half, bottom, top]): [Corner, Corner, Corner, Corner] => [
    [x, half, bottom],
    [x, half, top],
    [x, -half, top],
    [x, -half, bottom],
  ]);
  const faces: Corner[][] = [[...corners[0]!], [...corners.at(-1)!].reverse()];
  for (let index = 0; index + 1 < corners.length; index++) {
    const [front, back] = [corners[index]!, corners[index + 1]!];
    for (let side = 0; side < 3; side++) faces.push([front[side]!, back[side]!, back[side + 1]!, front[side + 1]!]);
  }
  return faces;
}

/** The upper side of a wheel's tread and its outer face; `side` is 1 on the left, -1 on the right. */
function wheel(x: number, side: 1 | -1): Corner[][] {
  const { radius, inside, outside, sides } = WHEEL;
  const rim = (corner: number, y: number): Corner => {
    const angle = (2 * Math.PI * (corner + 0.5)) / sides;
    return [x + radius * Math.sin(angle), side * y, radius - radius * Math.cos(angle)];
  };
  const outer = Array.from({ length: sides }, (_, corner) => rim(corner, outside));
  const faces = [outer];
  for (let corner = 1; corner < sides - 2; corner++)
    faces.push([rim(corner, inside), rim(corner + 1, inside), rim(corner + 1, outside), rim(corner, outside)]);
  return side > 0 ? faces.map((face) => [...face].reverse()) : faces;
}

/** Its body is white, to be tinted; see Paint. */
export function carGeometry(): three.BufferGeometry {
  const { length, width, height } = SHADOW;
  const shadow: Corner[] = [
    [length, width, height],
    [-length, width, height],
    [-length, -width, height],
    [length, -width, height],
  ];
  const wheels = [-0.09, 0.088].flatMap((x) => [...wheel(x, 1), ...wheel(x, -1)]);
  const parts: [Corner[][], number][] = [
    [hull(BODY), 0xffffff],
    [hull(GLASS), 0x262b33],
    [hull(WING), 0xe8e8e8],
    [wheels, 0x15181c],
    [[shadow], 0x252b34],
  ];
  const positions = new Array<number>();
  const colors = new Array<number>();
  for (const [faces, color] of parts)
    for (const face of faces)
      for (let corner = 1; corner + 1 < face.length; corner++) {
        positions.push(...face[0]!, ...face[corner]!, ...face[corner + 1]!);
        const tint = new three.Color(color).toArray();
        colors.push(...tint, ...tint, ...tint);
      }
  const geometry = painted(positions, colors);
  geometry.computeVertexNormals();
  return geometry;
}
