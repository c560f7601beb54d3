/** What the cars drive on: the road with its lines, its kerbs and its start. */
import * as three from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { TrackGeometry } from "../api/client";
import { gantryGeometry } from "./gantry";
import { kerbGeometry } from "./kerbs";
import { paintGround } from "./paint";

export const RISE = 0.004; // m between layers, so that none shows through another
const LINE = 0.0762; // m, width of the white lines

type Points = number[][];

/** A band between two lines of the same number of points, to be seen from above whichever way they run. */
function band(from: Points, to: Points, isClosed: boolean, height: number): three.BufferGeometry {
  const positions = from.flatMap((point, index) => [
    point[0]!,
    point[1]!,
    height,
    to[index]![0]!,
    to[index]![1]!,
    height,
  ]);
  const indices: number[] = [];
  const last = isClosed ? from.length : from.length - 1;
  let area = 0; // m², negative where the other line is on the right
  for (let index = 0; index < last; index++) {
    const next = (index + 1) % from.length;
    const [a, b] = [2 * index, 2 * next];
    indices.push(a, b, a + 1, b, b + 1, a + 1);
    const [along, across] = [
      [from[next]![0]! - from[index]![0]!, from[next]![1]! - from[index]![1]!],
      [to[index]![0]! - from[index]![0]!, to[index]![1]! - from[index]![1]!],
    ];
    area += along[0]! * across[1]! - along[1]! * across[0]!;
  }
  if (area < 0) indices.reverse();
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(positions, 3));
  geometry.setIndex(indices);
  return geometry;
}

/** A line moved towards another by a width in metres. */
const inward = (line: Points, other: Points, width: number): Points =>
  line.map((point, index) => {
    const [dx, dy] = [other[index]![0]! - point[0]!, other[index]![1]! - point[1]!];
    const share = width / Math.max(Math.hypot(dx, dy), 1e-6);
    return [point[0]! + dx * share, point[1]! + dy * share];
  });

/** Dashes along the middle. */
function dashes(center: Points, isClosed: boolean): three.BufferGeometry {
  const pieces: three.BufferGeometry[] = [];
  const line = isClosed ? [...center, center[0]!] : center;
  let next = 0;
  let walked = 0;
  for (let index = 0; index + 1 < line.length; index++) {
    const [a, b] = [line[index]!, line[index + 1]!];
    const length = Math.hypot(b[0]! - a[0]!, b[1]! - a[1]!);
    for (; next < walked + length; next += 0.24) {
      const share = (next - walked) / length;
      const piece = new three.PlaneGeometry(0.12, 0.03);
      piece.rotateZ(Math.atan2(b[1]! - a[1]!, b[0]! - a[0]!));
      piece.translate(a[0]! + (b[0]! - a[0]!) * share, a[1]! + (b[1]! - a[1]!) * share, 2 * RISE);
      pieces.push(piece);
    }
    walked += length;
  }
  return mergeGeometries(pieces);
}

/** The road as one mesh; what lies on top comes first, so that nothing below it is painted for nothing. */
export function roadGeometry(track: TrackGeometry): three.BufferGeometry {
  const { inner, outer, center, is_closed: isClosed } = track;
  const kerbs = kerbGeometry(track, RISE / 2);
  return mergeGeometries([
    gantryGeometry(track, 2.5 * RISE),
    paintGround(dashes(center, isClosed), 0xffb02e),
    paintGround(band(inner, inward(inner, outer, LINE), isClosed, 2 * RISE), 0xf4f4ef),
    paintGround(band(outer, inward(outer, inner, LINE), isClosed, 2 * RISE), 0xf4f4ef),
    paintGround(band(inner, outer, isClosed, RISE), 0x3b4350),
    ...(kerbs ? [kerbs] : []),
  ]);
}
