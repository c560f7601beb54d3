/** A row of slot machines, and a player who mostly takes the best so far. */
import type { Lot } from "./lot";
import { choose as greedy } from "./table";

export interface Player {
  pulls: number[];
  /** Mean reward of each arm so far. */
  values: number[];
  /** What always taking the best arm would have brought more, after each pull. */
  regret: number[];
}

export const newPlayer = (arms: number): Player => ({
  pulls: Array<number>(arms).fill(0),
  values: Array<number>(arms).fill(0),
  regret: [],
});

/** Chances to win of some arms. */
export const chances = (arms: number, lot: Lot): number[] => Array.from({ length: arms }, () => 0.1 + 0.8 * lot());

/** Which arm an ε-greedy player takes; among equals by lot. */
export const choose = ({ values }: Player, epsilon: number, lot: Lot): number => greedy(values, epsilon, lot);

/** Pull an arm: whether it won. The player remembers the mean, one step of 1/n at a time. */
export function pull(player: Player, arm: number, winning: number[], lot: Lot): boolean {
  const isWon = lot() < winning[arm]!;
  const n = ++player.pulls[arm]!;
  player.values[arm]! += (Number(isWon) - player.values[arm]!) / n;
  player.regret.push((player.regret.at(-1) ?? 0) + Math.max(...winning) - winning[arm]!);
  return isWon;
}
