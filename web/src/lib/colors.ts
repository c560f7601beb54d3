/** A scale that is read alike by all eyes and in grey: dark violet over teal to yellow. */
const STOPS = [
  [68, 1, 84],
  [59, 82, 139],
  [33, 145, 140],
  [94, 201, 98],
  [253, 231, 37],
] as const;

/** CSS colour of a share from 0 to 1, with commas, without which the 3D view does not read it. */
export function scale(share: number): string {
  const place = Math.min(Math.max(Number.isFinite(share) ? share : 0, 0), 1) * (STOPS.length - 1);
  const index = Math.min(Math.floor(place), STOPS.length - 2);
  const [from, to] = [STOPS[index]!, STOPS[index + 1]!];
  const mixed = from.map((value, channel) => Math.round(value + (to[channel]! - value) * (place - index)));
  return `rgb(${mixed.join(", ")})`;
}

/** Where the colours of a line along a lap begin: darker ones are lost on the road. */
export const LINE_FROM = 0.12;

/** Between which values a line along a lap takes its colours: the few farthest out would leave the rest one colour. */
export function lineRange(values: number[], least: number): [number, number] {
  const sorted = [...values].sort((a, b) => a - b);
  return span([sorted[Math.floor(sorted.length * 0.03)] ?? 0, sorted[Math.floor(sorted.length * 0.98)] ?? 1], least);
}

/** CSS colour of a value on such a line. */
export const onLine = (value: number, [low, high]: [number, number]): string =>
  scale(LINE_FROM + (1 - LINE_FROM) * Math.min(Math.max((value - low) / (high - low), 0), 1));

/** Hue, 0 to 1, of a car that learns, by how far round it is: from blue at the start to orange at the finish. */
export const hueOf = (progress: number): number => 0.58 - 0.5 * Math.min(Math.max(progress, 0), 1);
export const CAR_TONE = { saturation: 0.75, lightness: 0.55 };

/** The same as a CSS colour. */
export const carColor = (progress: number): string =>
  `hsl(${Math.round(360 * hueOf(progress))} ${100 * CAR_TONE.saturation}% ${Math.round(100 * CAR_TONE.lightness)}%)`;

/** Smallest and largest of some numbers, null left out; never equal, and no closer than `least`, so that noise is not painted as if it mattered. */
export function span(values: Iterable<number | null>, least = 0): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) if (value !== null) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (!Number.isFinite(low)) return [0, 1];
  const short = least - (high - low);
  if (short > 0) return [low - short / 2, high + short / 2];
  return high > low ? [low, high] : [low - 0.5, low + 0.5];
}
