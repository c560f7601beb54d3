/** What the state of a league's race is called. */
import { moment } from "../lib/dates";
import type { LeagueRace } from "./api";
import { l } from "./text";

export function stateOf(race: LeagueRace): string {
  if (race.state === "upcoming") return l("state_upcoming", { when: moment(race.opens) });
  if (race.state === "closed") return l("state_closed");
  return race.closes ? l("state_open_until", { when: moment(race.closes) }) : l("state_open");
}
