import type { MedalTimes } from "../api/client";

export const MEDALS = ["author", "gold", "silver", "bronze"] as const;
export type MedalName = (typeof MEDALS)[number];

/** The best medal that a lap time reaches, as the server's own: a time that equals a medal's has it. */
export function medalOf(times: MedalTimes | null | undefined, seconds: number | null | undefined): MedalName | "" {
  if (!times || seconds == null) return "";
  return MEDALS.find((name) => seconds <= times[name] + 1e-9) ?? "";
}

/** The medal that a lap time just misses, or that comes first where there is none; nothing where all are won or none is known. */
export function nextMedal(times: MedalTimes | null | undefined, seconds: number | null | undefined): MedalName | "" {
  if (!times) return "";
  return [...MEDALS].reverse().find((name) => seconds == null || seconds > times[name] + 1e-9) ?? "";
}

/** How much faster a lap has to be for a medal that it misses, in s: whole hundredths, rounded up, as the times are shown. */
export const missedBy = (times: MedalTimes, medal: MedalName, seconds: number): number =>
  Math.ceil(100 * (seconds - times[medal]) - 1e-6) / 100;
