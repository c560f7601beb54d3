/** A grid world, Q-learning in it, and its exact solution. */
import type { Lot } from "./lot";

/** S: start, #: wall, G: goal (+1), P: pit (−1). */
export const MAP = ["...#.G", ".#...P", "...#..", "S.P..."] as const;
export const ROWS = MAP.length;
export const COLUMNS = MAP[0].length;
export const STATES = ROWS * COLUMNS;
/** Up, right, down, left. */
export const MOVES = [
  [-1, 0],
  [0, 1],
  [1, 0],
  [0, -1],
] as const;
export const START = MAP.join("").indexOf("S");
const COST = -0.02; // of a step: who dawdles loses

export const signOf = (state: number): string => MAP.join("")[state]!;
export const isEnd = (state: number): boolean => "GP".includes(signOf(state));

export interface Outcome {
  after: number;
  reward: number;
  isOver: boolean;
}

/** What a move does: against a wall or the border one stays. */
export function outcome(state: number, action: number): Outcome {
  const row = Math.floor(state / COLUMNS) + MOVES[action]![0];
  const column = (state % COLUMNS) + MOVES[action]![1];
  const isInside = row >= 0 && row < ROWS && column >= 0 && column < COLUMNS;
  const there = row * COLUMNS + column;
  const after = isInside && signOf(there) !== "#" ? there : state;
  const reward = signOf(after) === "G" ? 1 : signOf(after) === "P" ? -1 : COST;
  return { after, reward, isOver: isEnd(after) };
}

/** Worth of every action in every state, (STATES, 4). */
export type Table = number[][];
export const emptyTable = (): Table => Array.from({ length: STATES }, () => [0, 0, 0, 0]);
export const best = (row: number[]): number => row.indexOf(Math.max(...row));

/** The exact table, by dynamic programming. */
export function solve(gamma: number, sweeps = 400): Table {
  let table = emptyTable();
  for (let sweep = 0; sweep < sweeps; sweep++)
    table = table.map((row, state) =>
      isEnd(state) || signOf(state) === "#"
        ? row
        : row.map((_, action) => {
            const { after, reward, isOver } = outcome(state, action);
            return reward + (isOver ? 0 : gamma * Math.max(...table[after]!));
          }),
    );
  return table;
}

export interface Settings {
  epsilon: number;
  alpha: number;
  gamma: number;
}

/** A step of Q-learning, which changes the table; where one is then, again at the start after an end. */
export function learn(table: Table, state: number, { epsilon, alpha, gamma }: Settings, lot: Lot): Outcome {
  const row = table[state]!;
  const ties = [0, 1, 2, 3].filter((action) => row[action] === Math.max(...row));
  const action = lot() < epsilon ? Math.floor(lot() * 4) : ties[Math.floor(lot() * ties.length)]!;
  const told = outcome(state, action);
  const target = told.reward + (told.isOver ? 0 : gamma * Math.max(...table[told.after]!));
  row[action]! += alpha * (target - row[action]!);
  return { ...told, after: told.isOver ? START : told.after };
}
