/** Somebody's pace over a season: how far behind the first, race by race. */
import type { SeasonRow } from "./api";

/** Per cent behind the first at which the line reaches its floor; whoever is slower stays there. */
const FLOOR = 100;

export interface Pace {
  title: string;
  /** Behind the first. */
  percent: number;
  /** 0 for the first to 1 at the floor; by the root, as what matters is near the top. */
  share: number;
}

/** One point for each race that is timed, the earliest first. */
export function paceOf(results: SeasonRow["results"]): Pace[] {
  return results.flatMap(({ title, gap }) => {
    if (gap === null) return [];
    const percent = 100 * gap;
    return [{ title, percent, share: Math.sqrt(Math.min(percent, FLOOR) / FLOOR) }];
  });
}

/** The races of a season, the earliest first, from what everybody did in them. */
export function racesOf(rows: SeasonRow[]): { race: number; title: string }[] {
  const found = new Map(rows.flatMap((row) => row.results.map(({ race, title }) => [race, { race, title }] as const)));
  return [...found.values()].sort((a, b) => a.race - b.race);
}

/** Everybody's rank in a season, most points first: who is level in points and wins shares it, as a place in a race is shared. */
export const ranksOf = (rows: Pick<SeasonRow, "points" | "wins">[]): number[] =>
  rows.map(({ points, wins }) => 1 + rows.findIndex((one) => one.points === points && one.wins === wins));
