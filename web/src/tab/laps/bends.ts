/** How a road bends, as racecraft.track.Track.curvature_at says it. */
import { wrapAngle, type Road } from "../road";

const WINDOW = 0.15; // m to each side over which the heading's difference is taken
const SAME_POINT = 1e-9; // m

/** As numpy.interp: of a list that never falls. */
export function interp(x: number, along: ArrayLike<number>, values: ArrayLike<number>): number {
  let [low, high] = [0, along.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (along[middle]! <= x) low = middle + 1;
    else high = middle;
  }
  if (low === 0) return values[0]!;
  if (low === along.length) return values[low - 1]!;
  const [from, to] = [along[low - 1]!, along[low]!];
  return ((values[low]! - values[low - 1]!) / (to - from)) * (x - from) + values[low - 1]!;
}

/** Curvature of a road's centre line at places on it, 1/m, left positive. */
export function curvatureOf({ arc, headings, length, isClosed }: Road): (s: number) => number {
  const unwrapped = [headings[0]!];
  for (let at = 1; at < headings.length; at++)
    unwrapped.push(unwrapped[at - 1]! + wrapAngle(headings[at]! - headings[at - 1]!));
  const middles = Array.from(headings, (_, at) => (arc[at + 1]! + arc[at]!) / 2);
  let [along, heading] = [middles, unwrapped];
  if (isClosed) {
    const [first, last] = [unwrapped[0]!, unwrapped.at(-1)!];
    const turn = last - first + wrapAngle(first - last);
    along = [-1, 0, 1].flatMap((lap) => middles.map((middle) => middle + lap * length));
    heading = [-1, 0, 1].flatMap((lap) => unwrapped.map((angle) => angle + lap * turn));
  }
  const window = Math.min(Math.max(WINDOW, length / headings.length), length / 4);
  return (s) => {
    const [before, after] = [Math.max(s - window, along[0]!), Math.min(s + window, along.at(-1)!)];
    const turn = interp(after, along, heading) - interp(before, along, heading);
    return turn / Math.max(after - before, SAME_POINT);
  };
}
