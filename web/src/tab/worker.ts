/** The thread beside the page in which cars drive and learn; it is ended by ending the worker. */
import type { Look } from "../lib/poses";
import { loadCore, type LoadedCore } from "./core";
import { read, type Plan, type TrackFile } from "./plan";
import { type Evaluation, type Iteration, type Reward, Trainer } from "./trainer";

export interface Start {
  site: string; // address of the site's folder
  plan: Plan;
  track: TrackFile;
  reward: string; // name of a preset
  seed: number;
  laps: number; // of an evaluation, until it ends
  most: number; // camera steps
}

export type Report =
  | { kind: "loaded"; isSlow: boolean; seconds: number }
  | { kind: "look"; look: Look }
  | { kind: "iteration"; iteration: Iteration; seconds: number }
  | { kind: "evaluation"; evaluation: Evaluation; steps: number; seconds: number }
  | { kind: "ended"; isReached: boolean }
  | { kind: "failed"; message: string };

const OFTEN = 66; // ms between two looks

const tell = (report: Report) => postMessage(report);

let core: Promise<LoadedCore> | undefined;
onmessage = ({ data }: MessageEvent<Start | { site: string }>) => {
  core ??= loadCore(async (file) => (await read(data.site, `core/${file}`)).arrayBuffer());
  if ("plan" in data) train(data, core).catch((error: Error) => tell({ kind: "failed", message: error.message }));
  else core.catch(() => {}); // is told when it is needed
};

async function train(start: Start, loading: Promise<LoadedCore>): Promise<void> {
  const began = performance.now();
  const seconds = () => (performance.now() - began) / 1000;
  const address = new URL("data/rewards.js", start.site).href;
  const [{ core: loaded, isSlow }, { rewards }] = await Promise.all([
    loading,
    import(/* @vite-ignore */ address) as Promise<{ rewards: Record<string, Reward> }>,
  ]);
  const trainer = new Trainer(loaded, start.plan, start.track, rewards[start.reward]!, start.seed);
  tell({ kind: "loaded", isSlow, seconds: seconds() });
  let looked = -Infinity;
  const look = () => {
    if (performance.now() - looked < OFTEN) return;
    looked = performance.now();
    tell({ kind: "look", look: lookOf(trainer, start.plan) });
  };
  while (trainer.steps < start.most) {
    tell({ kind: "iteration", iteration: trainer.iterate(look), seconds: seconds() });
    if (!trainer.needsEvaluation) continue;
    const evaluation = trainer.evaluate();
    tell({ kind: "evaluation", evaluation, steps: trainer.steps, seconds: seconds() });
    if (evaluation.lapTimes.length >= start.laps) return tell({ kind: "ended", isReached: true });
  }
  tell({ kind: "ended", isReached: false });
}

/** This moment as the console's server streams it. */
function lookOf({ cars, columns, steps }: Trainer, { cars: { width, height } }: Plan): Look {
  const { vehicles, rows, rowWidth, count, frames, numPixels } = cars;
  const column = (name: string, car: number) => rows[car * rowWidth + columns.indexOf(name)]!;
  const field = (index: number, car: number) => Math.round(vehicles[index * count + car]! * 1000);
  const all = Array.from({ length: count }, (_, car) => car);
  const poses = all.map((car) => [
    ...[0, 1, 2, 3, 6].map((index) => field(index, car)),
    Math.round(column("progress", car) * 1000),
  ]);
  const focus = all.reduce((best, car) => (poses[car]![5]! > poses[best]![5]! ? car : best), 0);
  const frame = String.fromCharCode(...frames.subarray(focus * numPixels, (focus + 1) * numPixels));
  return {
    step: steps,
    poses,
    steps: all.map((car) => column("steps", car)),
    policy: [],
    is_discrete: true,
    frame: btoa(frame),
    frame_shape: [height!, width!],
    focus,
  };
}
