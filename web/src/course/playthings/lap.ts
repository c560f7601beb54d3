/** A policy of probabilities on the road of places: how it learns (REINFORCE with a baseline), and what it does. */
import type { Lot } from "./lot";
import { emptyTable, type Table } from "./table";
import { go, laneOf, LANES, LENGTH, MIDDLE, MOVES, OFF, outcomes, placeAt, STATES } from "./track";

export interface Policy {
  preferences: Table; // (places, actions)
  baseline: number[]; // what came from each place, on average
}

export const newPolicy = (): Policy => ({
  preferences: emptyTable(STATES, MOVES.length),
  baseline: Array<number>(STATES).fill(0),
});

/** Preferences as probabilities. */
export function softmax(preferences: number[]): number[] {
  const top = Math.max(...preferences);
  const parts = preferences.map((one) => Math.exp(one - top));
  const sum = parts.reduce((all, one) => all + one, 0);
  return parts.map((one) => one / sum);
}

/** How undecided probabilities are, nats. */
export const entropy = (chances: number[]): number =>
  -chances.reduce((sum, p) => sum + (p > 0 ? p * Math.log(p) : 0), 0);

export interface Teaching {
  alpha: number;
  gamma: number;
  /** Weight of the entropy, which keeps the policy open. */
  beta: number;
  slip: number;
}

function draw(chances: number[], lot: Lot): number {
  let left = lot();
  const action = chances.findIndex((p) => (left -= p) < 0);
  return action < 0 ? chances.length - 1 : action;
}

/** Drive from a place by lot to the line or into the grass, and praise or blame what was done. */
export function episode({ preferences, baseline }: Policy, { alpha, gamma, beta, slip }: Teaching, lot: Lot): void {
  const steps: { place: number; action: number; reward: number }[] = [];
  for (let place = Math.floor(lot() * STATES), isOver = false; !isOver;) {
    const action = draw(softmax(preferences[place]!), lot);
    const told = go(place, action, slip, "line", lot);
    steps.push({ place, action, reward: told.reward });
    place = told.after;
    isOver = told.isOver;
  }
  let came = 0;
  for (const { place, action, reward } of steps.reverse()) {
    came = reward + gamma * came;
    const advantage = came - baseline[place]!;
    baseline[place]! += 0.1 * advantage;
    const row = preferences[place]!;
    const chances = softmax(row);
    const open = entropy(chances);
    chances.forEach((p, one) => {
      row[one]! += alpha * (advantage * (Number(one === action) - p) - beta * p * (Math.log(p) + open));
    });
  }
}

export interface Lap {
  /** Chance that a car that began in the middle of the line is at each place (places). */
  there: number[];
  /** Chances of the three actions in each segment, over the lanes where cars are (segments, actions). */
  actions: number[][];
  /** Share of cars that come round. */
  round: number;
  /** How open the policy is where its cars are: 0 always knows what to do, 1 draws by lot. */
  undecided: number;
}

/** What a policy does on a lap: no lot, but the whole distribution. */
export function lapOf(policy: Policy, slip: number): Lap {
  const there = Array<number>(STATES).fill(0);
  there[placeAt(0, MIDDLE)] = 1;
  const actions: number[][] = [];
  let round = 0;
  let open = 0;
  for (let segment = 0; segment < LENGTH; segment++) {
    const mass = MOVES.map(() => 0);
    for (let lane = 0; lane < LANES; lane++) {
      const place = placeAt(segment, lane);
      if (!there[place]) continue;
      const chances = softmax(policy.preferences[place]!);
      open += there[place]! * entropy(chances);
      chances.forEach((p, action) => {
        mass[action]! += there[place]! * p;
        for (const { after, chance } of outcomes(place, action, slip, "line")) {
          if (after === OFF) continue;
          const share = there[place]! * p * chance;
          if (segment === LENGTH - 1) round += share;
          else there[placeAt(segment + 1, laneOf(after))]! += share;
        }
      });
    }
    const sum = mass.reduce((all, one) => all + one, 0);
    actions.push(mass.map((one) => (sum > 0 ? one / sum : 1 / MOVES.length)));
  }
  const driven = there.reduce((sum, one) => sum + one, 0); // steps of a car
  return { there, actions, round, undecided: open / driven / Math.log(MOVES.length) };
}
