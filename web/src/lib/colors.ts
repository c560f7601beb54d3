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

/** Smallest and largest of some numbers, null left out; never equal, and no closer than `least`, so that noise is not painted as if it mattered. */
export function span(values: Iterable<number | null>, least = 0): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) if (value !== null) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (!Number.isFinite(low)) return [0, 1];
  const short = least - (high - low);
  if (short > 0) return [low - short / 2, high + short / 2];
  return high > low ? [low, high] : [low - 0.5, low + 0.5];
}
