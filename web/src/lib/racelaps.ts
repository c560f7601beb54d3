/** What several cars of a film did along the road: how far they were when, who was how much behind, and their laps. */
import type { RaceReplay } from "../api/races";
import { before } from "./laps";
import type { PlacedLap } from "./why";

export const RATE = 15; // rows a second
const JUMP = 0.5; // m in a row: it was put somewhere else
const SIDESTEP = 0.02; // m farther than in the row before, and then a stop: it was put from the border to the middle
const STOP = 0.1; // m less in the next row, which no brake does
const REACH = 2; // rows on either side of a speed

type Film = Pick<RaceReplay, "geometry" | "is_reversed">;
type Car = RaceReplay["cars"][number];

/** How far along the centre line a point is, m; of a closed line its end is its beginning. */
function placeOn(line: number[][], lengths: number[], isClosed: boolean, x: number, y: number): number {
  let [best, place] = [Infinity, 0];
  for (let index = 0; index < line.length - (isClosed ? 0 : 1); index++) {
    const [from, to] = [line[index]!, line[(index + 1) % line.length]!];
    const [dx, dy] = [to[0]! - from[0]!, to[1]! - from[1]!];
    const square = dx * dx + dy * dy;
    const share = square ? Math.min(Math.max(((x - from[0]!) * dx + (y - from[1]!) * dy) / square, 0), 1) : 0;
    const away = (x - from[0]! - share * dx) ** 2 + (y - from[1]! - share * dy) ** 2;
    if (away < best) [best, place] = [away, lengths[index]! + share * Math.sqrt(square)];
  }
  return place;
}

/** m of every row behind the start line in driving direction, on and on over the laps; it never falls. */
export function placesOf(film: Film, car: Car): number[] {
  const { center, is_closed, length } = film.geometry;
  const lengths = [0];
  center.forEach((point, index) => {
    const next = center[(index + 1) % center.length]!;
    lengths.push(lengths[index]! + Math.hypot(next[0]! - point[0]!, next[1]! - point[1]!));
  });
  let reached = 0;
  let last = 0;
  return car.trace.map(([x, y], row) => {
    const place = placeOn(center, lengths, is_closed, x! / 1000, y! / 1000);
    const driven = film.is_reversed ? length - place : place;
    if (row === 0) return (reached = last = driven);
    let step = driven - last;
    if (is_closed) step -= length * Math.round(step / length);
    last += step;
    return (reached = Math.max(reached, last));
  });
}

/** m from the start to where a film's graph has its points. */
export const distances = (places: number[][], count: number): number[] => {
  const most = Math.max(0, ...places.map((one) => (one.length ? one[one.length - 1]! - one[0]! : 0)));
  return Array.from({ length: count }, (_, index) => (most * index) / (count - 1));
};

/** Seconds that a car is behind another one after so many metres; null where one of them never came. */
export function gapAfter(places: number[], against: number[], metres: number[]): (number | null)[] {
  return metres.map((metre) => {
    const [mine, theirs] = [places, against].map((one) => rowAt(one, metre));
    return mine == null || theirs == null ? null : (mine - theirs) / RATE;
  });
}

/** The row, with a fraction, in which a car was so many metres from its start. */
function rowAt(places: number[], metre: number): number | null {
  const place = places[0]! + metre;
  if (!places.length || place > places[places.length - 1]!) return null;
  const row = before(places, place);
  if (places[row] === place) return places.indexOf(place); // it may have stood there
  return row + (place - places[row]!) / (places[row + 1]! - places[row]!);
}

/** The fastest lap of a car's trial; undefined where it completed none. */
export function fastestLap(car: Car, places: number[]): PlacedLap | undefined {
  const laps = car.laps.map((end, index): [number, number] => [index ? car.laps[index - 1]! : 0, end]);
  const [from, end] = laps.reduce((best, lap) => (lap[1] - lap[0] < best[1] - best[0] ? lap : best), laps[0] ?? [0, 0]);
  const rows = car.trace.slice(from, end + 1);
  if (end - from < 2 * REACH + 1) return undefined;
  const [x, y] = [0, 1].map((axis) => rows.map((row) => row[axis]! / 1000)) as [number[], number[]];
  const step = (row: number) => Math.hypot(x[row + 1]! - x[row]!, y[row + 1]! - y[row]!);
  const isPut = (row: number) =>
    step(row) > JUMP || (step(row) > step(row - 1) + SIDESTEP && step(row) > step(row + 1) + STOP);
  const steps = rows.slice(1).map((_, row) => (isPut(row) ? 0 : step(row)));
  const speed = rows.map((_, row) => {
    const around = steps.slice(Math.max(0, row - REACH), row + REACH);
    return (RATE * around.reduce((sum, one) => sum + one, 0)) / around.length;
  });
  return {
    place: places.slice(from, end + 1),
    time: rows.map((_, row) => row / RATE),
    puts: rows.map((_, row) => row).filter((row) => row > 0 && isPut(row - 1)),
    ...{ x, y, speed },
  };
}

/** Where the car is in a row, m from its start. */
export const metreAt = (places: number[], row: number): number =>
  (places[Math.min(row, places.length - 1)] ?? 0) - (places[0] ?? 0);
