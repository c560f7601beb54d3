/** A road of places: a car goes on by one segment a step, chooses its lane, and is carried outwards in bends. */
import type { Lot } from "./lot";
import { choose, emptyTable, update, worth, type Outcome, type Settings, type Table } from "./table";

export const LENGTH = 48; // segments of a lap
export const LANES = 5; // across; 0 is the left border
export const STATES = LENGTH * LANES;
/** To the left, straight on, to the right: what is added to the lane. */
export const MOVES = [-1, 0, 1] as const;
export const MIDDLE = (LANES - 1) / 2;
export const OFF = -1; // no place: the grass

/** What is paid, beside −1 for leaving the road: the line at the end of the lap, or the middle of the road. */
export type Pay = "line" | "middle";

export const placeAt = (segment: number, lane: number): number => segment * LANES + lane;
export const segmentOf = (place: number): number => Math.floor(place / LANES);
export const laneOf = (place: number): number => place % LANES;

export type Point = readonly [x: number, y: number];
const FINE = 60; // points a segment, while its shape is measured

/** Middle of the road at the beginning of each segment, and its direction in rad; in units of the picture, y downwards. */
export const shape = (() => {
  const at = (turn: number): Point => {
    const r = 1 + 0.2 * Math.cos(2 * turn + 0.5) + 0.16 * Math.cos(3 * turn + 1.2);
    return [288 + 205 * r * Math.cos(turn), 170 - 132 * r * Math.sin(turn)];
  };
  const count = LENGTH * FINE;
  const points = [...Array(count + 1).keys()].map((i) => at((2 * Math.PI * i) / count));
  const along = [0];
  for (let i = 1; i <= count; i++)
    along.push(along[i - 1]! + Math.hypot(points[i]![0] - points[i - 1]![0], points[i]![1] - points[i - 1]![1]));
  return [...Array(LENGTH).keys()].map((segment) => {
    const i = along.findIndex((length) => length >= (along[count]! * segment) / LENGTH);
    const before = points[(i - 1 + count) % count]!;
    const after = points[(i + 1) % count]!;
    return { point: points[i]!, heading: Math.atan2(before[1] - after[1], after[0] - before[0]) };
  });
})();

/** How each segment bends, from −1 (the sharpest, to the right) to 1 (to the left). */
export const bends = (() => {
  const turns = shape.map(({ heading }, i) => {
    const turn = shape[(i + 1) % LENGTH]!.heading - heading;
    return Math.atan2(Math.sin(turn), Math.cos(turn));
  });
  const most = Math.max(...turns.map(Math.abs));
  return turns.map((turn) => turn / most);
})();

const reward = (lane: number, isLine: boolean, pay: Pay): number =>
  pay === "line" ? Number(isLine) : (1 - Math.abs(lane - MIDDLE) / (MIDDLE + 1)) / 10;

/** What a move can lead to, and how likely. `slip` is the chance to be carried outwards by the sharpest bend. */
export function outcomes(place: number, action: number, slip: number, pay: Pay): (Outcome & { chance: number })[] {
  const segment = segmentOf(place);
  const lane = laneOf(place) + MOVES[action]!;
  const bend = bends[segment]!;
  const chance = slip * Math.abs(bend);
  const told = (lane: number): Outcome => {
    if (lane < 0 || lane >= LANES) return { after: OFF, reward: -1, isOver: true };
    const isLine = segment === LENGTH - 1;
    const isOver = isLine && pay === "line";
    return { after: placeAt((segment + 1) % LENGTH, lane), reward: reward(lane, isLine, pay), isOver };
  };
  const held = { ...told(lane), chance: 1 - chance };
  return chance ? [held, { ...told(lane + Math.sign(bend)), chance }] : [held];
}

/** One of them by lot. */
export function go(place: number, action: number, slip: number, pay: Pay, lot: Lot): Outcome {
  const [held, carried] = outcomes(place, action, slip, pay);
  return carried && lot() < carried.chance ? carried : held!;
}

export const newTable = (): Table => emptyTable(STATES, MOVES.length);

/** The exact table, by dynamic programming: backwards, lap by lap, until the line's worth has gone round. */
export function solve(gamma: number, slip: number, pay: Pay, laps = 12): Table {
  const table = newTable();
  for (let lap = 0; lap < (pay === "line" ? 1 : laps); lap++)
    for (let place = STATES - 1; place >= 0; place--)
      table[place] = MOVES.map((_, action) =>
        outcomes(place, action, slip, pay).reduce((sum, one) => sum + one.chance * worth(table, one, gamma), 0),
      );
  return table;
}

/** A step of Q-learning; where the car is then, after an end at a place by lot. */
export function learn(table: Table, place: number, slip: number, pay: Pay, settings: Settings, lot: Lot): Outcome {
  const action = choose(table[place]!, settings.epsilon, lot);
  const told = go(place, action, slip, pay, lot);
  update(table, place, action, told, settings);
  return { ...told, after: told.isOver ? Math.floor(lot() * STATES) : told.after };
}
