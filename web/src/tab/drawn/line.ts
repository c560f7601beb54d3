/** Polylines as racecraft.track.polyline has them: points (W, 2), flat. */
export type Line = Float64Array;

export const pointsOf = (line: Line): number => line.length / 2;

/** Distance along a line at each of its points, from 0. */
export function arcOf(line: Line): Float64Array {
  const arc = new Float64Array(pointsOf(line));
  for (let at = 1; at < arc.length; at++)
    arc[at] = arc[at - 1]! + Math.hypot(line[2 * at]! - line[2 * at - 2]!, line[2 * at + 1]! - line[2 * at - 1]!);
  return arc;
}

/** As numpy.linspace, ends included. */
export function spread(from: number, to: number, count: number): Float64Array {
  const values = Float64Array.from({ length: count }, (_, at) => from + at * ((to - from) / (count - 1)));
  values[count - 1] = to;
  return values;
}

/** As numpy.interp, of places that never fall: the search goes on where the last one ended. */
export function along(places: ArrayLike<number>, arc: ArrayLike<number>, values: ArrayLike<number>): Float64Array {
  let piece = 0;
  return Float64Array.from(places, (place) => {
    if (place < arc[piece]!) piece = 0;
    while (piece + 1 < arc.length && arc[piece + 1]! <= place) piece++;
    if (piece + 1 === arc.length || place <= arc[piece]!) return values[piece]!;
    const [from, to] = [arc[piece]!, arc[piece + 1]!];
    return ((values[piece + 1]! - values[piece]!) / (to - from)) * (place - from) + values[piece]!;
  });
}

/** The points of a line at distances along it. */
export function pointsAt(line: Line, arc: Float64Array, places: ArrayLike<number>): Line {
  const axes = [0, 1].map((axis) =>
    along(
      places,
      arc,
      Float64Array.from({ length: arc.length }, (_, at) => line[2 * at + axis]!),
    ),
  );
  return Float64Array.from({ length: 2 * places.length }, (_, at) => axes[at % 2]![at >> 1]!);
}

/** The line driven the other way. */
export const turned = (line: Line): Line =>
  Float64Array.from({ length: line.length }, (_, at) => line[2 * (pointsOf(line) - 1 - (at >> 1)) + (at % 2)]!);

/** Area inside a ring, positive when it runs counter-clockwise. */
export function areaOf(ring: Line): number {
  let sum = 0;
  const [x0, y0] = [ring[0]!, ring[1]!];
  for (let at = 0; at + 3 < ring.length; at += 2)
    sum += (ring[at]! - x0) * (ring[at + 3]! - y0) - (ring[at + 2]! - x0) * (ring[at + 1]! - y0);
  return sum / 2;
}

export const isRing = (line: Line): boolean => line[0] === line.at(-2) && line[1] === line.at(-1);
