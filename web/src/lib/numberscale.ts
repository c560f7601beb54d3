/** A number on a slider from 0 to 1000, even or logarithmic, and back. */
import type { NumberChoice } from "../api/client";

export const STEPS = 1000;

export function toSlider(choice: NumberChoice, value: number): number {
  const share = choice.is_logarithmic
    ? Math.log(value / choice.low) / Math.log(choice.high / choice.low)
    : (value - choice.low) / (choice.high - choice.low);
  return Math.round(Math.min(Math.max(Number.isFinite(share) ? share : 0, 0), 1) * STEPS);
}

export function fromSlider(choice: NumberChoice, place: number): number {
  const share = place / STEPS;
  if (choice.allowed?.length) {
    const value = choice.low + share * (choice.high - choice.low);
    return choice.allowed.reduce((best, one) => (Math.abs(one - value) < Math.abs(best - value) ? one : best));
  }
  const value = choice.is_logarithmic
    ? choice.low * (choice.high / choice.low) ** share
    : choice.low + share * (choice.high - choice.low);
  return choice.is_whole ? Math.round(value) : +value.toPrecision(choice.high > 0.9 && choice.low >= 0.5 ? 4 : 2);
}

export const isSafe = (choice: NumberChoice, value: number): boolean =>
  value >= choice.safe_low * 0.999 && value <= choice.safe_high * 1.001;

/** Seconds until a limit of steps or time is reached; null where only skill counts. */
export function estimate(until: string, pace: number): number | null {
  let found: number | null = null;
  for (const part of until.toLowerCase().split(/\bor\b/)) {
    const match = /^\s*([\d,_.]+)\s*(steps?|s|sec|secs|seconds?|min|mins|minutes?|h|hours?)\s*$/.exec(part);
    if (!match) continue;
    const amount = Number(match[1]!.replace(/[,_]/g, ""));
    const unit = match[2]!;
    const seconds = unit.startsWith("step")
      ? pace > 0
        ? amount / pace
        : NaN
      : amount * (unit.startsWith("h") ? 3600 : unit.startsWith("m") ? 60 : 1);
    if (Number.isFinite(seconds)) found = found === null ? seconds : Math.min(found, seconds);
  }
  return found;
}
