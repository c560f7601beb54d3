/** The corners of a road, and the road cut in the middle of its straights: racecraft.track.corners and
 * racecraft.analysis.corners. */
import type { components } from "../../api/schema";
import { roundHalfEven, type Road } from "../road";
import { curvatureOf } from "./bends";

export type Sector = components["schemas"]["TrackSector"];

interface Corner {
  start: number; // m from the start line, where the road begins to bend
  apex: number; // where half of the turn is done
  end: number; // beyond the length where the corner spans the start line
  turn: number; // rad, left positive
  radius: number; // m, the tightest
}

const STRAIGHT_RADIUS = 7; // m; wider bends count as straight
const MIN_TURN = (17 * Math.PI) / 180; // smaller turns are kinks
const STEP = 0.05; // m between samples

export function findCorners(road: Road): Corner[] {
  const { length, isClosed } = road;
  const count = Math.max(8, roundHalfEven(length / STEP));
  const [step, curvature] = [length / count, curvatureOf(road)];
  const sampled = Array.from({ length: count }, (_, at) => curvature((at + 0.5) * step));
  const sides = sampled.map((one) => (Math.abs(one) > 1 / STRAIGHT_RADIUS ? Math.sign(one) : 0));
  const change = sides.findIndex((side, at) => side !== sides.at(at - 1));
  const first = isClosed && change > 0 ? change : 0; // between two stretches, so that the start line cuts none
  const rolled = <T>(list: T[]) => [...list.slice(first), ...list.slice(0, first)];
  const [side, bend] = [rolled(sides), rolled(sampled)];
  const edges = side.flatMap((one, at) => (at > 0 && one !== side[at - 1] ? [at] : []));
  const corners: Corner[] = [];
  [0, ...edges].forEach((begin, index) => {
    const end = edges[index] ?? count;
    const bends = bend.slice(begin, end);
    const turn = bends.reduce((sum, one) => sum + one, 0) * step;
    if (side[begin] === 0 || Math.abs(turn) < MIN_TURN) return;
    const half = bends.reduce((sum, one) => sum + Math.abs(one), 0) / 2;
    let [apex, done] = [begin, Math.abs(bends[0]!)];
    while (done < half) done += Math.abs(bends[++apex - begin]!);
    const start = (first + begin) * step;
    const lap = start >= length ? length : 0;
    const middle = (first + apex + 0.5) * step - lap;
    corners.push({
      ...{ start: start - lap, apex: ((middle % length) + length) % length, end: start - lap + (end - begin) * step },
      ...{ turn, radius: 1 / Math.max(...bends.map(Math.abs)) },
    });
  });
  return corners.sort((a, b) => a.start - b.start);
}

/** Every corner with half of the straights around it; together they are the whole lap. */
export function sectorsOf(road: Road): Sector[] {
  const { length, isClosed } = road;
  const corners = findCorners(road);
  if (!corners.length) return [{ number: 1, start: 0, end: length, apex: length / 2, turn: 0 }];
  const cuts = corners.slice(1).map((corner, index) => (corners[index]!.end + corner.start) / 2);
  const over = (corners.at(-1)!.end + corners[0]!.start + length) / 2;
  const edges = isClosed ? [over - length, ...cuts, over] : [0, ...cuts, length];
  return corners.map(({ apex, turn }, index) => ({
    ...{ number: index + 1, start: edges[index]!, end: edges[index + 1]!, apex, turn },
  }));
}
