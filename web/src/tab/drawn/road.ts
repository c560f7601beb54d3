/** The road of a drawing: racecraft.track.sketch and curve, with the same micrometres. */
import { bends, type Sketch } from "../../lib/sketch";
import { roundHalfEven } from "../road";
import { along, arcOf, areaOf, pointsAt, pointsOf, spread, type Line } from "./line";

const FINE = 0.02; // m between the samples of the line
const SPACING = 0.15; // m between waypoints

export interface Lines {
  center: Line;
  inner: Line;
  outer: Line;
}

/** Centre line and borders, not yet judged: they may cross. */
export function roadOf({ points, is_closed: isClosed }: Sketch): Lines {
  const ring = isClosed ? [...points, points[0]!] : points;
  const places = ring.map(({ x, y }): [number, number] => [x, y]);
  const lengths = places.slice(1).map(([x, y], at) => Math.hypot(x - places[at]![0], y - places[at]![1]));
  const steps = lengths.map(Math.sqrt);
  const nodes = [0];
  for (const step of steps) nodes.push(nodes.at(-1)! + step);
  const bent = bends(places, steps, isClosed);
  const count = Math.max(16, Math.ceil(lengths.reduce((sum, one) => sum + one, 0) / FINE));
  const at = spread(0, nodes.at(-1)!, 2 * count + 1);
  const line = new Float64Array(2 * at.length);
  let piece = 0;
  at.forEach((place, sample) => {
    while (piece + 1 < steps.length && nodes[piece + 1]! <= place) piece++;
    const [step, after] = [steps[piece]!, place - nodes[piece]!];
    const before = step - after;
    for (const axis of [0, 1] as const) {
      const [a, b, from, to] = [
        bent[piece]![axis],
        bent[piece + 1]![axis],
        places[piece]![axis],
        places[piece + 1]![axis],
      ];
      line[2 * sample + axis] =
        (a * before ** 3 + b * after ** 3) / (6 * step) +
        (from / step - (a * step) / 6) * before +
        (to / step - (b * step) / 6) * after;
    }
  });
  if (isClosed) line.set(line.subarray(0, 2), line.length - 2);
  const arc = arcOf(line);
  const even = spread(0, arc.at(-1)!, Math.max(16, roundHalfEven(arc.at(-1)! / FINE)) + 1);
  const fine = pointsAt(line, arc, even);
  if (isClosed) fine.set(fine.subarray(0, 2), fine.length - 2);
  const wide = along(
    along(even, arc, at),
    nodes,
    ring.map(({ width }) => width),
  );
  return roadAlong(fine, wide, isClosed);
}

function roadAlong(line: Line, widths: Float64Array, isClosed: boolean): Lines {
  const arc = arcOf(line);
  const length = arc.at(-1)!;
  const s = spread(0, length, Math.max(4, roundHalfEven(length / SPACING)) + 1);
  const round = (place: number) =>
    isClosed ? ((place % length) + length) % length : Math.min(Math.max(place, 0), length);
  const [center, before, after] = [s, s.map((one) => round(one - FINE)), s.map((one) => round(one + FINE))].map(
    (places) => pointsAt(line, arc, places),
  ) as [Line, Line, Line];
  const half = along(s, arc, widths);
  const left = new Float64Array(center.length);
  for (let at = 0; at < pointsOf(center); at++) {
    const [x, y] = [2 * at, 2 * at + 1];
    let [dx, dy] = [after[x]! - before[x]!, after[y]! - before[y]!];
    if (dx === 0 && dy === 0) [dx, dy] = [center[x]! - before[x]!, center[y]! - before[y]!]; // it goes back on itself
    const norm = Math.hypot(dx, dy);
    [left[x], left[y]] = [((-dy / norm) * half[at]!) / 2, ((dx / norm) * half[at]!) / 2];
  }
  if (isClosed) {
    center.set(center.subarray(0, 2), center.length - 2);
    left.set(left.subarray(0, 2), left.length - 2);
  }
  const side = isClosed && areaOf(line) < 0 ? -1 : 1;
  const micro = (value: number) => roundHalfEven(value * 1e6) / 1e6 + 0; // no negative zero
  return {
    center: center.map(micro),
    inner: center.map((value, at) => micro(value + side * left[at]!)),
    outer: center.map((value, at) => micro(value - side * left[at]!)),
  };
}
