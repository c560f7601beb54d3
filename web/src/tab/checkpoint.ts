/** A checkpoint as the installed program writes and resumes it, of a training in this tab: racecraft.training.session. */
import type { Plan, Policy } from "./plan";
import { tensorFile, type Tensor } from "./safetensors";
import type { Judgement, TrainingState } from "./trainer";

export interface Checkpoint {
  step: number; // camera steps; 0 of weights alone
  score: number[] | null;
  metrics: Record<string, number | null>;
  file: Uint8Array<ArrayBuffer>;
}

/** Weights alone: training goes on from them with Adam's moments, cars and seeds of its own. */
export function weightsAlone(
  policy: Policy,
  weights: Float32Array,
  { steps, seconds }: { steps: number; seconds: number },
): Checkpoint {
  const metadata = { network: policy.spec, origin: { kind: "tab", steps } };
  const about = { step: 0, time_stamp: seconds, score: null, metrics: {}, metadata };
  const file = tensorFile(split("weights", weights, policy), { racecraft: JSON.stringify(about) });
  return { step: 0, score: null, metrics: {}, file };
}

/** All of a training: the installed program goes on with the step that would have come next here. */
export function wholeTraining(
  plan: Plan,
  policy: Policy,
  weights: Float32Array,
  {
    state,
    judgement,
    seconds,
    created,
  }: { state: TrainingState; judgement: Judgement; seconds: number; created: number },
): Checkpoint {
  const { seed, iteration, steps, totals, lengths, returnScale, simulation } = state;
  const numCars = totals.length;
  const arrays: Record<string, Tensor> = {
    "ppo/counters": { data: BigInt64Array.of(BigInt(seed), BigInt(iteration), BigInt(steps)), shape: [3] },
    "ppo/episode_returns": { data: totals, shape: [numCars] },
    "ppo/episode_lengths": { data: lengths, shape: [numCars] },
    "ppo/return_scale": { data: returnScale, shape: [2] },
    ...split("weights", weights, policy),
    ...split("learning", state.learning, policy),
    ...split("average", state.average, policy),
    ...split("optimizer/moment1", state.moment1, policy),
    ...split("optimizer/moment2", state.moment2, policy),
    "optimizer/step": { data: Float32Array.of(state.updates), shape: [1] },
    simulation: { data: simulation, shape: [simulation.length] },
    episode_rewards: { data: totals, shape: [numCars] },
    // what only logs need: nothing of the episodes under way
    "trace/steps": { data: new Float64Array(), shape: [0, plan.traceWidth] },
    "trace/lengths": { data: new Float64Array(numCars), shape: [numCars] },
    recent_episodes: { data: new Float64Array(), shape: [0, 2] },
  };
  const { completions, lapTimes, bestScore, bestLap, episodes } = judgement;
  const completion = completions.reduce((sum, one) => sum + one, 0) / completions.length;
  const lap = lapTimes.length ? Math.min(...lapTimes) : null;
  const score = [completion, -(lap ?? NO_LAP)];
  const last = { step: steps, seconds, completions, lap_times: lapTimes, is_best: score.join() === bestScore.join() };
  const metadata = {
    network: policy.spec,
    ...{ episodes, clock: steps / 15, seconds },
    evaluator: { last, best_score: bestScore, best_lap: bestLap },
  };
  const metrics = { completion, laps: lapTimes.length, best_lap_s: lap };
  const about = { step: steps, time_stamp: created, score, metrics, metadata };
  return { step: steps, score, metrics, file: tensorFile(arrays, { racecraft: JSON.stringify(about) }) };
}

export const NO_LAP = 1e6; // s, in a score, where no lap was completed

function split(part: string, flat: Float32Array, { weights }: Policy): Record<string, Tensor> {
  let at = 0;
  return Object.fromEntries(
    weights.map(([name, shape]) => {
      const size = shape.reduce((all, side) => all * side, 1);
      return [`${part}/${name}`, { data: flat.subarray(at, (at += size)), shape }];
    }),
  );
}
