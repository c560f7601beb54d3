/** Laps that a model drove while it learned, all from the same start: where each car was, and colours from first to best. */
import type { Evolution } from "../api/client";
import { scale } from "./colors";
import { turn } from "../scene/poses";

export type EvolutionLap = Evolution["laps"][number];

const RATE = 15; // poses a second

/** How long a lap, or the attempt at one, lasts, s. */
export const secondsOf = (lap: EvolutionLap): number => (lap.poses.length - 1) / RATE;

/** Where its car is so many seconds after the start; it stays where it came to. */
export function placeAt(lap: EvolutionLap, seconds: number): { x: number; y: number; heading: number } {
  const place = Math.min(Math.max(seconds * RATE, 0), lap.poses.length - 1);
  const row = Math.floor(place);
  const [from, to] = [lap.poses[row]!, lap.poses[Math.min(row + 1, lap.poses.length - 1)]!];
  const at = (axis: number) => (from[axis]! + (to[axis]! - from[axis]!) * (place - row)) / 1000;
  return { x: at(0), y: at(1), heading: from[2]! / 1000 + turn(from[2]! / 1000, to[2]! / 1000) * (place - row) };
}

/** A colour for each of so many cars: dark for the first, bright for the best. */
export const colorsOf = (count: number): string[] =>
  Array.from({ length: count }, (_, index) => scale(0.12 + (0.88 * index) / Math.max(count - 1, 1)));
