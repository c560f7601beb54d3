/** A final in which two meet at a time, as it is shown. */
import type { FinalPage } from "./api";
import type { LeagueKey } from "./en";

export type Duel = FinalPage["duels"][number];

/** The duels of each round, the first round first. */
export function roundsOf(duels: Duel[]): Duel[][] {
  const rounds: Duel[][] = [];
  for (const duel of duels) (rounds[duel.round] ??= []).push(duel);
  return rounds;
}

/** What a round is called: of a bracket by how many are left, else by its number. */
export function roundName(page: FinalPage, round: number): [LeagueKey, Record<string, number>?] {
  const rounds = roundsOf(page.duels).length;
  if (page.form !== "bracket") return ["final_round", { number: round + 1 }];
  const left = rounds - round;
  if (left === 1) return ["final_final"];
  if (left === 2) return ["final_semi"];
  return left === 3 ? ["final_quarter"] : ["final_of", { count: 2 ** left }];
}

/** The same final with nothing told of duels that were not shown yet, nor of who meets after them. */
export function veiled(page: FinalPage, shown: ReadonlySet<number>): FinalPage {
  const isOver = page.duels.every((duel) => shown.has(duel.number));
  return {
    ...page,
    finalists: page.finalists.map((one) => ({ ...one, place: isOver ? one.place : null })),
    duels: page.duels.map((duel) => ({
      ...duel,
      winner: shown.has(duel.number) ? duel.winner : null,
      racers: duel.racers.map((racer) => ({
        ...racer,
        seed: racer.source === null || shown.has(racer.source) ? racer.seed : null,
        score: shown.has(duel.number) ? racer.score : null,
        completion: shown.has(duel.number) ? racer.completion : null,
      })),
    })),
  };
}
