/** Kerbs along the inside of bends, red and white, beyond the white line: they show from afar where the road turns. */
import * as three from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { TrackGeometry } from "../api/client";
import { paintGround } from "./paint";

type Point = [x: number, y: number];

const BLOCK = 0.16; // m along the middle of the road
const WIDTH = 0.085; // m
const REACH = 0.3; // m before and behind a place, between which its bend is measured
const [BEGINS, IS_WHOLE] = [1 / 2.4, 1 / 1.9]; // 1/m, bend from which on there is a kerb, and all of its width
const [RED, WHITE] = [0xc8372d, 0xeeeeea];

/** The three lines of a road by the distance driven along its middle. */
class Lines {
  readonly length: number;
  private readonly starts: number[] = [0];

  constructor(private readonly track: TrackGeometry) {
    const { center } = track;
    for (let index = 1; index < center.length + (track.is_closed ? 1 : 0); index++) {
      const [a, b] = [center[index - 1]!, center[index % center.length]!];
      this.starts.push(this.starts.at(-1)! + Math.hypot(b[0]! - a[0]!, b[1]! - a[1]!));
    }
    this.length = this.starts.at(-1)!;
  }

  /** A place of one of the lines. */
  at(line: "center" | "inner" | "outer", distance: number): Point {
    const along = this.track.is_closed
      ? ((distance % this.length) + this.length) % this.length
      : Math.min(Math.max(distance, 0), this.length);
    let [low, high] = [0, this.starts.length - 2];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.starts[middle]! <= along) low = middle;
      else high = middle - 1;
    }
    const points = this.track[line];
    const [a, b] = [points[low]!, points[(low + 1) % points.length]!];
    const share = (along - this.starts[low]!) / Math.max(this.starts[low + 1]! - this.starts[low]!, 1e-9);
    return [a[0]! + (b[0]! - a[0]!) * share, a[1]! + (b[1]! - a[1]!) * share];
  }

  /** How much the middle bends, 1/m, left positive. */
  bend(distance: number): number {
    const [before, here, after] = [-REACH, 0, REACH].map((step) => this.at("center", distance + step));
    const [first, second] = [
      [here![0] - before![0], here![1] - before![1]],
      [after![0] - here![0], after![1] - here![1]],
    ];
    const cross = first[0]! * second[1]! - first[1]! * second[0]!;
    const along = first[0]! * second[0]! + first[1]! * second[1]!;
    return Math.atan2(cross, along) / REACH;
  }
}

/** Moved away from another point by a width. */
function beyond(point: Point, other: Point, width: number): Point {
  const [dx, dy] = [point[0] - other[0], point[1] - other[1]];
  const share = width / Math.max(Math.hypot(dx, dy), 1e-9);
  return [point[0] + dx * share, point[1] + dy * share];
}

const widthAt = (bend: number): number =>
  WIDTH * Math.min(Math.max((Math.abs(bend) - BEGINS) / (IS_WHOLE - BEGINS), 0), 1);

function block([a, b, c, d]: [Point, Point, Point, Point], height: number, color: number): three.BufferGeometry {
  const area = (c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0]);
  const geometry = new three.BufferGeometry();
  const corners = [a, b, c, d].flatMap(([x, y]) => [x, y, height]);
  geometry.setAttribute("position", new three.Float32BufferAttribute(corners, 3));
  geometry.setIndex(area > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2]);
  return paintGround(geometry, color);
}

/** The kerbs of a track, lower than its road, which covers them where it comes by a second time; null without bends. */
export function kerbGeometry(track: TrackGeometry, height: number): three.BufferGeometry | null {
  const lines = new Lines(track);
  const count = Math.floor(lines.length / BLOCK);
  const length = lines.length / Math.max(count, 1);
  const pieces: three.BufferGeometry[] = [];
  for (let index = 0; index < count; index++) {
    const [from, to] = [index * length, (index + 1) * length];
    const bend = lines.bend((from + to) / 2);
    if (Math.abs(bend) < BEGINS) continue;
    const [first, second] = [lines.at("inner", from), lines.at("outer", from)];
    const [here, ahead] = [lines.at("center", from), lines.at("center", to)];
    const side = (ahead[0] - here[0]) * (first[1] - here[1]) - (ahead[1] - here[1]) * (first[0] - here[0]);
    const [near, far] = side * bend > 0 ? (["inner", "outer"] as const) : (["outer", "inner"] as const);
    const [a, b] = [near === "inner" ? first : second, lines.at(near, to)];
    const [c, d] = [
      beyond(b, lines.at(far, to), widthAt(lines.bend(to))),
      beyond(a, near === "inner" ? second : first, widthAt(lines.bend(from))),
    ];
    pieces.push(block([a, b, c, d], height, index % 2 ? WHITE : RED));
  }
  return pieces.length ? mergeGeometries(pieces) : null;
}
