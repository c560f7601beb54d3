/** A training in this thread: PPO's loop of the core, a reward in JavaScript, evaluations by the rules of `racecraft train`. */
import type { Cars, Core, Episode, Learner, Training } from "./core";
import type { Trace } from "./drivencar";
import { toldObjects } from "./objects";
import { startPose } from "./placement";
import { firstWeights, type Beginning } from "./begin";
import { NO_LAP } from "./checkpoint";
import { arraysOf, type Plan, type Policy, type RacePlan, type TrackFile } from "./plan";
import type { Pay } from "./python";
import { Road } from "./road";
import type { Objects } from "./verify/header";

/** A preset, as racecraft.site.javascript writes it. */
export interface Reward {
  remembers: boolean; // something between two calls, so that every car needs its own
  make: () => (row: Float64Array, waypoints: [number, number][][]) => number;
}

/** A preset, for the rows of a step. */
export function payWith(reward: Reward, { waypoints }: TrackFile, numCars: number): Pay {
  const made = Array.from({ length: reward.remembers ? numCars : 1 }, reward.make);
  return (rows) => {
    const width = rows.length / numCars;
    return Float64Array.from({ length: numCars }, (_, car) =>
      made[car % made.length]!(rows.subarray(car * width, (car + 1) * width), waypoints),
    );
  };
}

export interface Evaluation {
  completions: number[]; // 0 to 1
  lapTimes: number[]; // s, of completed laps
  weights: Float32Array; // that drove
  trace: Trace; // of the fastest lap, from its start; empty without one
}

export interface Iteration {
  steps: number; // camera steps so far
  ended: Episode[];
  completion: number | null; // mean share of the lap of the episodes that ended
}

/** Where a training is; arrays of weights are flat. */
export interface TrainingState {
  seed: number;
  iteration: number;
  steps: number;
  learning: Float32Array;
  average: Float32Array;
  moment1: Float32Array; // of Adam
  moment2: Float32Array;
  updates: number;
  simulation: Uint8Array;
  totals: Float64Array; // of the episodes under way: rewards
  lengths: BigInt64Array; // and steps
  returnScale: Float64Array; // mean and spread
}

/** What evaluations said so far, as racecraft.training.evaluator remembers it. */
export interface Judgement {
  completions: number[]; // of the last one
  lapTimes: number[];
  bestScore: number[]; // mean completion, and less the fastest lap
  bestLap: number | null; // s
  episodes: number; // that ended
}

/** What is trained. */
export interface Asked {
  plan: Plan;
  race: RacePlan;
  policy: Policy;
  objects: Objects;
  track: TrackFile;
  seed: number;
  begin?: Beginning | undefined; // fresh weights without one
}

const CONTROL_DT = 1 / 15; // s
const RUNNING = ["prepare", "in_progress"];

export class Trainer {
  readonly cars: Cars;
  readonly columns: string[];
  private readonly trials: Cars;
  private readonly learner: Learner;
  private readonly training: Training;
  private readonly table: Float64Array;
  private readonly road: Road;
  private readonly plan: Plan;
  private readonly race: RacePlan;
  private readonly track: TrackFile;
  private readonly pay: Pay;
  readonly seed: number;
  private mean: Float32Array | undefined;
  private shares: number[] = []; // of the lap, of the episodes that ended
  private iteration = 0;
  private evaluatedAt = 0;
  private episodes = 0;
  private bestScore = [-1, -NO_LAP];
  private bestLap: number | null = null;

  constructor(
    private readonly core: Core,
    asked: Asked,
    payFor: (numColumns: number) => Pay,
  ) {
    const { plan, race, policy, objects, track, seed } = asked;
    [this.plan, this.race, this.track, this.seed] = [plan, race, track, seed];
    const road = core.track(arraysOf(track));
    const told = toldObjects(objects);
    const around = told ? { objects: told } : {};
    this.cars = road.cars({ ...race.cars, seed }, plan.vehicle, around);
    this.trials = road.cars({ ...race.trials, seed: 0 }, plan.vehicle, around);
    this.road = new Road(track, false);
    this.pay = payFor(this.cars.rowWidth);
    this.columns = core.names("row");
    this.table = Float64Array.from(policy.table);
    this.learner = core.learner(policy.network);
    const fresh = initialWeights(core, policy, seed);
    const { begin } = asked;
    this.learner.write("weights", begin ? firstWeights(policy.weights, fresh, begin) : fresh);
    this.training = this.learner.train(this.cars, policy.ppo, this.table);
  }

  get steps(): number {
    return this.training.totalSteps;
  }

  get needsEvaluation(): boolean {
    return this.steps - this.evaluatedAt >= this.race.evaluateEvery;
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
    const ended = training.ended();
    this.episodes += ended.length;
    return {
      steps: this.steps,
      ended,
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

  /** Everything that the next iteration depends on, as a checkpoint of the installed program has it. */
  state(): TrainingState {
    const { learner, training, cars } = this;
    const learning = learner.read("weights");
    return {
      seed: this.seed,
      iteration: this.iteration,
      steps: this.steps,
      learning,
      average: this.mean?.slice() ?? learning,
      moment1: learner.read("moment1"),
      moment2: learner.read("moment2"),
      updates: learner.numUpdates,
      simulation: cars.save(),
      ...training.underWay(cars.count),
    };
  }

  /** What goes with it: the last evaluation's outcome, and the best so far. */
  judgement({ completions, lapTimes }: Evaluation): Judgement {
    const { bestScore, bestLap, episodes } = this;
    return { completions, lapTimes, bestScore, bestLap, episodes };
  }

  private get wasGood(): boolean {
    return this.bestScore[0]! >= this.race.good;
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
    this.lineUp();
    const most = Math.round(this.track.geometry.length / this.plan.slowest / CONTROL_DT);
    const traces = Array.from({ length: trials.count }, (): Trace => []);
    const isOver = (trial: number) => trials.terminated[trial] || trials.truncated[trial];
    for (let step = 0; step < most; step++) {
      trials.step(learner.best(trials, this.table));
      const { terminated, truncated, vehicles } = trials;
      const field = (index: number, trial: number) => Math.round(1000 * vehicles[index * trials.count + trial]!);
      for (const [trial, trace] of traces.entries())
        if (!isOver(trial)) trace.push([field(0, trial), field(1, trial), field(2, trial)]);
      if (terminated.every((flag, car) => flag || truncated[car])) break;
    }
    learner.write("weights", learning);
    const judged = this.judged();
    const evaluation = { ...judged, weights, trace: traces[judged.fastest] ?? [] };
    this.evaluatedAt = this.steps;
    const mean = evaluation.completions.reduce((sum, one) => sum + one, 0) / trials.count;
    const lap = judged.lapTimes.length ? Math.min(...judged.lapTimes) : null;
    const score = [mean, -(lap ?? NO_LAP)];
    const isBest = score[0] === this.bestScore[0] ? score[1]! >= this.bestScore[1]! : score[0]! > this.bestScore[0]!;
    if (isBest) this.bestScore = score;
    if (lap !== null) this.bestLap = Math.min(lap, this.bestLap ?? lap);
    return evaluation;
  }

  /** Every trial at its start, as racecraft.race.placement.line_up: the first where the simulation puts it. */
  private lineUp(): void {
    const { trials, core, road, plan } = this;
    const hasObjects = trials.rowWidth > this.columns.length;
    const seed = BigInt((this.seed + plan.evaluationSeed) % 2 ** 32);
    const keys = BigUint64Array.from({ length: trials.count }, (_, trial) => BigInt(trial) + (seed << 20n));
    trials.reset(undefined, hasObjects ? keys : undefined); // the same objects every time
    const column = this.columns.indexOf("offset");
    const offsets = Array.from({ length: trials.count }, (_, trial) => trials.rows[trial * trials.rowWidth + column]!);
    for (let trial = 1; trial < trials.count; trial++) {
      const offset = hasObjects ? offsets[trial]! : 0; // an object near the start asks for the other lane
      const { x, y, heading } = startPose(core, road, plan.known.rules["first_lap"]!, { seed, trial, lap: 0, offset });
      trials.setPose(trial, x, y, heading);
    }
  }

  private judged(): Omit<Evaluation, "weights" | "trace"> & { fastest: number } {
    const { rows, rowWidth, count } = this.trials;
    const of = (name: string, car: number) => rows[car * rowWidth + this.columns.indexOf(name)]!;
    const cars = Array.from({ length: count }, (_, car) => car);
    const isComplete = (car: number) => this.plan.statuses[of("status", car)] === "lap_complete";
    const complete = cars.filter(isComplete);
    const time = (car: number) => of("time", car);
    return {
      fastest: complete.length ? complete.reduce((best, car) => (time(car) < time(best) ? car : best)) : -1,
      completions: cars.map((car) => (isComplete(car) ? 1 : Math.min(Math.max(of("progress", car), 0), 1))),
      lapTimes: complete.map(time),
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
