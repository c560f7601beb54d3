/** A grid world, Q-learning in it, and its exact solution. */
import type { Lot } from "./lot";
import { choose, emptyTable, update, worth, type Outcome, type Settings, type Table } from "./table";

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

export const newTable = (): Table => emptyTable(STATES, MOVES.length);

/** The exact table, by dynamic programming. */
export function solve(gamma: number, sweeps = 400): Table {
  let table = newTable();
  for (let sweep = 0; sweep < sweeps; sweep++)
    table = table.map((row, state) =>
      isEnd(state) || signOf(state) === "#" ? row : row.map((_, action) => worth(table, outcome(state, action), gamma)),
    );
  return table;
}

/** A step of Q-learning, which changes the table; where one is then, again at the start after an end. */
export function learn(table: Table, state: number, settings: Settings, lot: Lot): Outcome {
  const action = choose(table[state]!, settings.epsilon, lot);
  const told = outcome(state, action);
  update(table, state, action, told, settings);
  return { ...told, after: told.isOver ? START : told.after };
}
