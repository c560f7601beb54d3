/** What the state of a league's race is called. */
import { moment } from "../lib/dates";
import type { BoardPage, LeagueRace } from "./api";
import { l } from "./text";

export function stateOf(race: LeagueRace): string {
  if (race.state === "upcoming") return l("state_upcoming", { when: moment(race.opens) });
  if (race.state === "closed") return l("state_closed");
  return race.closes ? l("state_open_until", { when: moment(race.closes) }) : l("state_open");
}

/** How many are in a race, and how many of them are being driven now where any are. */
export function crowdOf({ entrants, running }: Pick<BoardPage, "entrants" | "running">): string {
  const told = l("screen_entrants", { entrants });
  return running ? `${told} · ${l("screen_driving", { running })}` : told;
}
