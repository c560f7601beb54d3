/** A cardboard box on the road, as large as the simulator's. */
import * as three from "three";
import { painted } from "./paint";

const [LENGTH, WIDTH, HEIGHT] = [0.4, 0.3, 0.25]; // m
const CARDBOARD = 0xc08a4e;
const TAPE = 0xe3c491;

export function boxGeometry(): three.BufferGeometry {
  const positions: number[] = [];
  const colors: number[] = [];
  const face = (corners: [number, number, number][], color: number) => {
    const tint = new three.Color(color).toArray();
    for (const index of [0, 1, 2, 0, 2, 3]) {
      positions.push(...corners[index]!);
      colors.push(...tint);
    }
  };
  const [a, b, h] = [LENGTH / 2, WIDTH / 2, HEIGHT];
  const around: [number, number][] = [
    [a, b],
    [-a, b],
    [-a, -b],
    [a, -b],
  ];
  around.forEach(([x, y], index) => {
    const [u, v] = around[(index + 1) % 4]!;
    face(
      [
        [u, v, 0],
        [x, y, 0],
        [x, y, h],
        [u, v, h],
      ],
      CARDBOARD,
    );
  });
  const lid = (half: number, height: number, color: number) =>
    face(
      [
        [a, half, height],
        [-a, half, height],
        [-a, -half, height],
        [a, -half, height],
      ],
      color,
    );
  lid(b, h, CARDBOARD);
  lid(0.03, h + 0.002, TAPE);
  const geometry = painted(positions, colors);
  geometry.computeVertexNormals();
  return geometry;
}
