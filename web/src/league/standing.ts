/** What a race's page says of one's own place, and of who may enter. */
import { moment } from "../lib/dates";
import { fixed } from "../lib/numbers";
import type { BoardRow, LeagueRace, SubmissionInfo } from "./api";
import { l } from "./text";

/** How far one is behind the first, and ahead of how many per cent of the others; who leads knows both. */
export function standingOf(mine: Pick<BoardRow, "place" | "gap">, beaten: number | null | undefined): string {
  if (mine.place === null) return l("mine_unranked");
  if (!mine.gap) return l("mine_leads");
  const gap = l("mine_gap", { gap: fixed(mine.gap, 2) });
  return beaten ? `${gap} · ${l("mine_beaten", { percent: Math.round(beaten) })}` : gap;
}

/** Of who is on no board: whether all that they entered was taken out. */
export const absenceOf = (submissions: Pick<SubmissionInfo, "disqualified">[]): string =>
  l(submissions.length > 0 && submissions.every((one) => one.disqualified) ? "mine_out" : "mine_none");

/** How often one may enter, or why not now. */
export function entryOf(race: Pick<LeagueRace, "state" | "opens" | "attempts_per_day">): string {
  if (race.state === "closed") return l("enter_closed");
  if (race.state === "upcoming") return l("enter_upcoming", { when: moment(race.opens) });
  return race.attempts_per_day ? l("enter_limited", { count: race.attempts_per_day }) : l("enter_lead");
}
