/** A track in driving direction, as far as placing cars on it needs it: racecraft.track.Track, operation by operation, so
 * that the same bits come out. Lengths and headings were computed by that. */
import { doublesOf, type TrackFile } from "./plan";

type Line = Float64Array; // (W, 2) m
export type Point = [number, number];

export const roundHalfEven = (value: number): number => {
  const nearest = Math.round(value);
  return Math.abs(value % 1) === 0.5 && nearest % 2 ? nearest - 1 : nearest;
};

const modulo = (value: number, size: number): number => {
  const rest = value % size;
  return rest !== 0 && rest < 0 !== size < 0 ? rest + size : rest;
};

export const wrapAngle = (angle: number): number => modulo(angle + Math.PI, 2 * Math.PI) - Math.PI;

export class Road {
  readonly length: number;
  readonly isClosed: boolean;
  private readonly center: Line;
  private readonly borders: { left: Line; right: Line };
  readonly arc: Float64Array; // (W,) m along the centre line
  readonly headings: Float64Array; // (W - 1,) rad of each piece

  constructor({ told, road }: TrackFile, isReversed: boolean) {
    const { count } = told;
    const side = isReversed ? 1 : 0;
    const lines = doublesOf(told.lines);
    const line = (index: number) => lines.subarray((3 * side + index) * 2 * count, (3 * side + index + 1) * 2 * count);
    this.center = line(0);
    const [inner, outer] = [line(1), line(2)];
    this.borders = road.innerIsLeft[side] ? { left: inner, right: outer } : { left: outer, right: inner };
    this.arc = doublesOf(road.arcs).subarray(side * count, (side + 1) * count);
    this.headings = doublesOf(road.headings).subarray(side * (count - 1), (side + 1) * (count - 1));
    this.length = this.arc[count - 1]!;
    this.isClosed = told.isClosed;
  }

  pointAt(s: number): Point {
    return this.interpolate(this.onTrack(s), (index, axis) => this.center[2 * index + axis]!);
  }

  headingAt(s: number): number {
    return this.headings[Math.min(this.piece(this.onTrack(s)), this.headings.length - 1)]!;
  }

  /** Between the places of both borders that are nearest to `s`, m. */
  widthAt(s: number): number {
    const [x, y] = this.pointAt(s);
    const [[x0, y0], [x1, y1]] = [nearest(this.borders.left, x, y), nearest(this.borders.right, x, y)];
    return Math.sqrt((x0 - x1) * (x0 - x1) + (y0 - y1) * (y0 - y1));
  }

  /** Number of the piece of the centre line at a place on it, the last one at the end. */
  pieceOf(place: number): number {
    return Math.min(Math.max(this.piece(place), 0), this.headings.length - 1);
  }

  /** Midway between the centre line and a border. */
  laneAt(s: number, isLeft: boolean): Point {
    const border = isLeft ? this.borders.left : this.borders.right;
    return this.interpolate(s, (index, axis) => 0.5 * (this.center[2 * index + axis]! + border[2 * index + axis]!));
  }

  /** Distance along the centre line and signed distance from it, left positive. */
  project(x: number, y: number): Point {
    const { center, arc } = this;
    let [best, found, offset] = [Infinity, 0, 0];
    for (let piece = 0; piece + 1 < arc.length; piece++) {
      const [x0, y0] = [center[2 * piece]!, center[2 * piece + 1]!];
      const [dx, dy] = [center[2 * piece + 2]! - x0, center[2 * piece + 3]! - y0];
      const squared = dx * dx + dy * dy;
      const [toX, toY] = [x - x0, y - y0];
      const along = Math.min(Math.max((toX * dx + toY * dy) / squared, 0), 1);
      const [offX, offY] = [toX - along * dx, toY - along * dy];
      const away = offX * offX + offY * offY;
      if (!(away < best)) continue;
      const isRight = Object.is(Math.sign(dx * toY - dy * toX), -0) || dx * toY - dy * toX < 0;
      [best, found] = [away, arc[piece]! + along * Math.sqrt(squared)];
      offset = isRight ? -Math.sqrt(away) : Math.sqrt(away);
    }
    return [found, offset];
  }

  /** m that a place is ahead of another along the track, the shorter way round a closed one. */
  ahead(place: number, s: number): number {
    const ahead = place - s;
    return this.isClosed ? ahead - this.length * roundHalfEven(ahead / this.length) : ahead;
  }

  /** A place so many metres on, taken round a closed track and kept on an open one. */
  onTrack(s: number): number {
    return this.isClosed ? modulo(s, this.length) : Math.min(Math.max(s, 0), this.length);
  }

  /** The piece of the line that begins at `s` or last before it. */
  private piece(s: number): number {
    let [low, high] = [0, this.arc.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.arc[middle]! <= s) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** As numpy.interp. */
  private interpolate(s: number, value: (index: number, axis: number) => number): Point {
    const last = this.arc.length - 1;
    const piece = s >= this.arc[last]! ? last : Math.max(this.piece(s), 0);
    return [0, 1].map((axis) => {
      const from = value(piece, axis);
      const begin = this.arc[piece]!;
      if (piece === last || s <= begin) return from;
      return ((value(piece + 1, axis) - from) / (this.arc[piece + 1]! - begin)) * (s - begin) + from;
    }) as Point;
  }
}

/** The place of a line that is nearest to a point; of equal ones the first. Points may be repeated. */
function nearest(line: Line, x: number, y: number): Point {
  let best = Infinity;
  let found: Point = [line[0]!, line[1]!];
  for (let at = 0; at + 3 < line.length; at += 2) {
    const [x0, y0] = [line[at]!, line[at + 1]!];
    const [dx, dy] = [line[at + 2]! - x0, line[at + 3]! - y0];
    const squared = dx * dx + dy * dy;
    if (squared === 0) continue;
    const along = Math.min(Math.max(((x - x0) * dx + (y - y0) * dy) / squared, 0), 1);
    const [offX, offY] = [x - x0 - along * dx, y - y0 - along * dy];
    const away = offX * offX + offY * offY;
    if (away < best) [best, found] = [away, [x0 + along * dx, y0 + along * dy]];
  }
  return found;
}
