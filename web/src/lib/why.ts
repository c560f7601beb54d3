/** Why one lap is faster than another: what each corner gained, and what of the driving shows it. */
import type { components } from "../api/schema";
import type { Key } from "../i18n/en";
import { fixed } from "./numbers";
import { interpolate } from "./laps";

export type Sector = components["schemas"]["TrackSector"];

/** A lap along the centre line; all lists have one entry a row. */
export interface PlacedLap {
  /** m behind the start line in driving direction, from where the lap began to a round further; never falls. */
  place: number[];
  /** s */
  time: number[];
  /** m/s */
  speed: number[];
  x: number[];
  y: number[];
  /** Rows in which it stands where it was put after a mistake. */
  puts: number[];
}

export type Reason =
  "puts" | "fewer" | "brakes" | "lifts" | "arrives" | "middle" | "accelerates" | "leaves" | "way" | "pace";

export interface Gain {
  /** Of the corner. */
  sector: Sector;
  /** s that the second lap is faster than the first; below zero it is slower. */
  seconds: number;
  /** What the faster one of them does otherwise. */
  reason: Reason;
  /** m/s of `arrives`, `middle` and `leaves`, else m. */
  amount: number;
}

const STEP = 0.05; // m between places that are compared
const SPEED = 0.05; // m/s, m and s below which a difference is none
const METRES = 0.1;
const SECONDS = 0.005;
const FALL = 0.25; // m/s by which the speed falls where it is braked
const CRAWL = 0.2; // m/s, less than which counts as this
const SHORT = 0.02; // share of a lap that its last row may be before its end
const EDGE = 0.15; // share of a fall or rise after which it has begun

/** What the second lap gained on the first in every corner that both got through, and why. */
export function gainsOf(first: PlacedLap, second: PlacedLap, sectors: Sector[], length: number): Gain[] {
  return sectors.flatMap((sector) => {
    const [a, b] = [through(first, sector, length), through(second, sector, length)];
    if (!a || !b) return [];
    const seconds = sum(a.took) - sum(b.took);
    // where one of them began its lap in here, the longer part tells why
    const cuts = [0, ...[...a.seams, ...b.seams].sort((p, q) => p - q).map((seam) => seam + 1), a.speed.length];
    const [from, to] = cuts
      .slice(1)
      .map((end, index): [number, number] => [cuts[index]!, end])
      .reduce((longest, part) => (part[1] - part[0] > longest[1] - longest[0] ? part : longest));
    const [slow, fast] = (seconds >= 0 ? [a, b] : [b, a]).map((one) => drivingOf(one, from, to)) as [Driving, Driving];
    return [{ sector, seconds, ...reasonOf(slow, fast) }];
  });
}

/** A lap at places of a sector, a step apart, and from each to the next; nothing where the lap ends and begins. */
interface Passage {
  speed: number[];
  took: number[];
  driven: number[];
  seams: number[];
  /** How often it was put back. */ puts: number;
  /** m */ step: number;
}

function through(lap: PlacedLap, sector: Sector, length: number): Passage | null {
  const [begin, end] = [lap.place[0]!, lap.place[lap.place.length - 1]!];
  const count = Math.max(8, Math.round((sector.end - sector.start) / STEP));
  const step = (sector.end - sector.start) / count;
  const after = (place: number, from: number) => (((place - from) % length) + length) % length;
  const places = Array.from({ length: count + 1 }, (_, index) => begin + after(sector.start + index * step, begin));
  if (places.some((place) => place > end + SHORT * length)) return null;
  const at = (values: number[]) => places.map((place) => interpolate(place, lap.place, values));
  const [times, x, y] = [at(lap.time), at(lap.x), at(lap.y)];
  const seams = places.slice(1).flatMap((place, index) => (place < places[index]! ? [index] : []));
  const between = (value: (index: number) => number) =>
    Array.from({ length: count }, (_, index) => (seams.includes(index) ? 0 : value(index)));
  return {
    speed: at(lap.speed),
    took: between((index) => times[index + 1]! - times[index]!),
    driven: between((index) => Math.hypot(x[index + 1]! - x[index]!, y[index + 1]! - y[index]!)),
    seams,
    puts: lap.puts.filter((row) => after(lap.place[row]!, sector.start) <= sector.end - sector.start).length,
    step,
  };
}

/** A passage, or a part of it in one piece, as it was driven; moments are indices of places. */
interface Driving extends Passage {
  slowest: number;
  /** Of the highest speed before that it is nearly the last one; null where the speed hardly falls. */
  brake: number | null;
  /** The first one behind the slowest of which the speed has begun to rise. */
  accelerate: number | null;
}

function drivingOf(passage: Passage, from: number, to: number): Driving {
  const speed = passage.speed.slice(from, to);
  const least = Math.min(...speed);
  const slowest = speed.indexOf(least);
  const [before, after] = [speed.slice(0, slowest + 1), speed.slice(slowest)];
  const [highest, next] = [Math.max(...before), Math.max(...after)];
  return {
    ...passage,
    speed,
    took: passage.took.slice(from, to - 1),
    driven: passage.driven.slice(from, to - 1),
    slowest,
    brake: highest - least >= FALL ? before.findLastIndex((one) => one >= highest - EDGE * (highest - least)) : null,
    accelerate: next - least >= FALL ? slowest + after.findIndex((one) => one >= least + EDGE * (next - least)) : null,
  };
}

/** What shows best why one passage is faster: of all differences the one where most of the time was gained. */
function reasonOf(slow: Driving, fast: Driving): { reason: Reason; amount: number } {
  if (slow.puts > fast.puts) return { reason: fast.puts ? "fewer" : "puts", amount: 0 };
  if (fast.puts) return { reason: "pace", amount: 0 }; // where cars stand and are put, their driving tells nothing
  const gained = (from: number, to: number) => sum(slow.took.slice(from, to)) - sum(fast.took.slice(from, to));
  const faster = (at: number) => fast.speed[at]! - slow.speed[at]!;
  const last = slow.speed.length - 1;
  const middle = fast.brake === null ? slow.slowest : Math.round((slow.slowest + fast.slowest) / 2);
  const into = Math.min(slow.brake ?? middle, fast.brake ?? middle);
  const out = Math.max(middle, Math.min(slow.accelerate ?? middle, fast.accelerate ?? middle));
  const found: [Reason, number, number][] = []; // with its amount, and the seconds that it explains
  const tell = (reason: Reason, amount: number, least: number, seconds: number) => {
    if (amount >= least && seconds >= SECONDS) found.push([reason, amount, seconds]);
  };
  tell("arrives", faster(0), SPEED, gained(0, into));
  // so many metres at the highest speed instead of the least
  const shifted = (metres: number, highest: number) =>
    metres / Math.max(slow.speed[slow.slowest]!, CRAWL) - metres / Math.max(highest, CRAWL);
  const brakes = slow.brake !== null && fast.brake !== null ? (fast.brake - slow.brake) * slow.step : 0;
  const braking = shifted(brakes, Math.max(...slow.speed.slice(0, slow.slowest + 1)));
  tell("brakes", brakes, METRES, braking);
  if (slow.brake !== null && fast.brake === null) tell("lifts", 1, 0, gained(into, out));
  const through = fast.speed[fast.slowest]! - slow.speed[slow.slowest]!;
  tell("middle", through, SPEED, gained(into, out) - Math.max(0, braking));
  const accelerates =
    slow.accelerate !== null && fast.accelerate !== null ? (slow.accelerate - fast.accelerate) * slow.step : 0;
  const accelerating = shifted(accelerates, Math.max(...slow.speed.slice(slow.slowest)));
  tell("accelerates", accelerates, METRES, accelerating);
  tell("leaves", faster(last), SPEED, gained(out, last) - Math.max(0, accelerating));
  const usual = sum(slow.speed) / slow.speed.length;
  const shorter = sum(slow.driven) - sum(fast.driven);
  tell("way", shorter, METRES, shorter / Math.max(usual, 0.1));
  found.sort((a, b) => b[2] - a[2]);
  const [reason, amount] = found[0] ?? ["pace", 0, 0];
  return { reason, amount };
}

/** The text of a gain, and what to fill in. */
export const sentenceOf = (gain: Gain, names: [string, string]): [Key, Record<string, string | number>] => [
  `why_${gain.reason}`,
  {
    who: gain.seconds >= 0 ? names[1] : names[0],
    whom: gain.seconds >= 0 ? names[0] : names[1],
    corner: gain.sector.number,
    amount: fixed(gain.amount, ["arrives", "middle", "leaves"].includes(gain.reason) ? 2 : 1),
  },
];

const sum = (values: number[]) => values.reduce((total, value) => total + value, 0);
