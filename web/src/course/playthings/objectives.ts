/** Two lines of the algorithms: advantages by GAE, and PPO's clipped objective. */

/** Advantage of each step from the surprises δ that follow it, the later the less. */
export function advantages(surprises: number[], gamma: number, lambda: number): number[] {
  const found = [...surprises];
  for (let t = found.length - 2; t >= 0; t--) found[t]! += gamma * lambda * found[t + 1]!;
  return found;
}

/** What PPO makes as large as it can, for one action whose probability changed by a ratio. */
export const clipped = (ratio: number, advantage: number, epsilon: number): number =>
  Math.min(ratio * advantage, Math.min(Math.max(ratio, 1 - epsilon), 1 + epsilon) * advantage);

/** Whether it still pulls at the probability: nothing does where the curve is flat. */
export const pulls = (ratio: number, advantage: number, epsilon: number): boolean =>
  advantage > 0 ? ratio < 1 + epsilon : advantage < 0 && ratio > 1 - epsilon;
