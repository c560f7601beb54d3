/** A table of what every action in every state is worth, and Q-learning in it: for a world of any kind. */
import type { Lot } from "./lot";

/** (states, actions). */
export type Table = number[][];

export interface Outcome {
  after: number;
  reward: number;
  isOver: boolean;
}

export interface Settings {
  epsilon: number;
  alpha: number;
  gamma: number;
}

export const emptyTable = (states: number, actions: number): Table =>
  Array.from({ length: states }, () => Array<number>(actions).fill(0));
export const best = (row: number[]): number => row.indexOf(Math.max(...row));

/** The best action so far, or one by lot; among equals by lot, too. */
export function choose(row: number[], epsilon: number, lot: Lot): number {
  if (lot() < epsilon) return Math.floor(lot() * row.length);
  const top = Math.max(...row);
  const ties = row.flatMap((value, action) => (value === top ? [action] : []));
  return ties[Math.floor(lot() * ties.length)]!;
}

/** What a step turned out to be worth. */
export const worth = (table: Table, { after, reward, isOver }: Outcome, gamma: number): number =>
  reward + (isOver ? 0 : gamma * Math.max(...table[after]!));

/** Q-learning: move the table a share α towards it. */
export function update(table: Table, state: number, action: number, told: Outcome, { alpha, gamma }: Settings): void {
  const row = table[state]!;
  row[action]! += alpha * (worth(table, told, gamma) - row[action]!);
}
