/** A training in this thread: PPO's loop of the core, a reward in JavaScript, evaluations by the rules of `racecraft train`. */
import type { Cars, Core, Episode, Learner, Training } from "./core";
import { arraysOf, type Plan, type Policy, type TrackFile } from "./plan";
import type { Pay } from "./python";

/** Reward of a row of the simulation. */
export type Reward = (row: Float64Array, waypoints: [number, number][][]) => number;

/** A preset, for the rows of a step. */
export const payWith =
  (reward: Reward, { waypoints }: TrackFile, numCars: number): Pay =>
  (rows) => {
    const width = rows.length / numCars;
    return Float64Array.from({ length: numCars }, (_, car) =>
      reward(rows.subarray(car * width, (car + 1) * width), waypoints),
    );
  };

export interface Evaluation {
  completions: number[]; // 0 to 1
  lapTimes: number[]; // s, of completed laps
  weights: Float32Array; // that drove
}

export interface Iteration {
  steps: number; // camera steps so far
  ended: Episode[];
  completion: number | null; // mean share of the lap of the episodes that ended
}

const CONTROL_DT = 1 / 15; // s
const RUNNING = ["prepare", "in_progress"];
const GOOD = 1; // mean completion from which on the averaged weights drive

export class Trainer {
  readonly cars: Cars;
  readonly columns: string[];
  private readonly trials: Cars;
  private readonly learner: Learner;
  private readonly training: Training;
  private readonly table: Float64Array;
  private mean: Float32Array | undefined;
  private shares: number[] = []; // of the lap, of the episodes that ended
  private iteration = 0;
  private evaluatedAt = 0;
  private wasGood = false;

  constructor(
    core: Core,
    private readonly plan: Plan,
    policy: Policy,
    private readonly track: TrackFile,
    private readonly pay: Pay,
    readonly seed: number,
  ) {
    const road = core.track(arraysOf(track));
    this.cars = road.cars({ ...plan.cars, seed }, plan.vehicle);
    this.trials = road.cars({ ...plan.trials, seed: 0 }, plan.vehicle);
    this.columns = core.names("row");
    this.table = Float64Array.from(policy.table);
    this.learner = core.learner(policy.network);
    this.learner.write("weights", initialWeights(core, policy, seed));
    this.training = this.learner.train(this.cars, policy.ppo, this.table);
  }

  get steps(): number {
    return this.training.totalSteps;
  }

  get needsEvaluation(): boolean {
    return this.steps - this.evaluatedAt >= this.plan.evaluateEvery;
  }

  /** Collect one rollout; `look` is called after every step. */
  drive(look: () => void): void {
    const { training, cars } = this;
    const [status, progress] = [this.columns.indexOf("status"), this.columns.indexOf("progress")];
    this.shares = [];
    training.begin(this.seed, this.iteration, this.steps);
    for (let isFull = false; !isFull;) {
      if (!training.drive()) throw new Error("The policy's outputs are no numbers any more. Try another reward.");
      const { rows, rowWidth } = cars;
      for (let at = 0; at < rows.length; at += rowWidth)
        if (!RUNNING.includes(this.plan.statuses[rows[at + status]!]!)) this.shares.push(rows[at + progress]!);
      const rewards = this.pay(rows);
      look();
      isFull = training.pay(rewards);
    }
  }

  /** Improve the policy on what was collected. */
  learn(): Iteration {
    const { training, shares } = this;
    if (!training.learn()) throw new Error("The loss is no number any more. Look for huge rewards.");
    this.iteration++;
    this.average();
    return {
      steps: this.steps,
      ended: training.ended(),
      completion: shares.length
        ? shares.reduce((sum, share) => sum + Math.min(Math.max(share, 0), 1), 0) / shares.length
        : null,
    };
  }

  /** As racecraft.learn.average: a running mean over about `averageShare` of the iterations so far. */
  private average(): void {
    const weights = this.learner.read("weights");
    const part = this.mean ? 1 / (1 + this.plan.averageShare * (this.iteration - 1)) : 1;
    const mean = (this.mean ??= weights);
    if (part === 1) return void mean.set(weights);
    const share = Math.fround(part);
    for (let i = 0; i < mean.length; i++) mean[i] = mean[i]! + Math.fround(Math.fround(weights[i]! - mean[i]!) * share);
  }

  private get drivingWeights(): Float32Array {
    return this.wasGood && this.mean ? this.mean : this.learner.read("weights");
  }

  /** One lap of every trial, with nobody to put it back. */
  evaluate(): Evaluation {
    const { trials, learner } = this;
    const learning = learner.read("weights");
    const weights = this.drivingWeights.slice();
    learner.write("weights", weights);
    trials.reset();
    for (const [index, [x, y, heading]] of this.track.starts[this.seed]!.entries())
      trials.setPose(index + 1, x, y, heading);
    const most = Math.round(this.track.geometry.length / this.plan.slowest / CONTROL_DT);
    for (let step = 0; step < most; step++) {
      trials.step(learner.best(trials, this.table));
      const { terminated, truncated } = trials;
      if (terminated.every((flag, car) => flag || truncated[car])) break;
    }
    learner.write("weights", learning);
    const evaluation = { ...this.judged(), weights };
    this.evaluatedAt = this.steps;
    const mean = evaluation.completions.reduce((sum, one) => sum + one, 0) / trials.count;
    this.wasGood ||= mean >= GOOD;
    return evaluation;
  }

  private judged(): Omit<Evaluation, "weights"> {
    const { rows, rowWidth, count } = this.trials;
    const of = (name: string, car: number) => rows[car * rowWidth + this.columns.indexOf(name)]!;
    const cars = Array.from({ length: count }, (_, car) => car);
    const isComplete = (car: number) => this.plan.statuses[of("status", car)] === "lap_complete";
    return {
      completions: cars.map((car) => (isComplete(car) ? 1 : Math.min(Math.max(of("progress", car), 0), 1))),
      lapTimes: cars.filter(isComplete).map((car) => of("time", car)),
    };
  }
}

function initialWeights(core: Core, policy: Policy, seed: number): Float32Array {
  const matrices = core.orthogonalWeights(seed, policy.layers);
  const sizes = policy.weights.map(([, shape]) => shape.reduce((size, side) => size * side, 1));
  const all = new Float32Array(sizes.reduce((sum, size) => sum + size, 0)); // biases are zero
  let [from, to] = [0, 0];
  for (const [index, [name]] of policy.weights.entries()) {
    const size = sizes[index]!;
    if (name.endsWith(".weight")) all.set(matrices.subarray(from, (from += size)), to);
    else if (name === "policy.log_std") all.fill(policy.logStd, to, to + size);
    to += size;
  }
  return all;
}
