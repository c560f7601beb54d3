/** The thread beside the page in which cars drive and learn, with Python where it is asked for; it is ended by ending the
 * worker. */
import { leaveAlone } from "./alone";
import { momentsAmong, type Among } from "./among";
import type { RewardPainting, RewardVerdict } from "../api/client";
import type { Drive, DriveState, Settings } from "../api/drives";
import type { Look, Picture } from "../scene/poses";
import { loadCore, type LoadedCore } from "./core";
import type { Beginning } from "./begin";
import { DrivenCar, type Trace } from "./drivencar";
import type { EvaluationLaps } from "../lib/laps";
import type { ToPay } from "./laps/paid";
import type { Eyes, Watched } from "./laps/watched";
import helperAddress from "./helper?worker&url";
import { objectsOf } from "./objects";
import { read, readTrack, type Plan, type Policy, type RacePlan, type TrackFile } from "./plan";
import { openUnderPolicy } from "./policed";
import { type Pay, Python, RewardFailure } from "./python";
import { ShownCar, shownWeights } from "./shown";
import { availableThreads } from "./team";
import {
  payWith,
  Trainer,
  type Evaluation,
  type Iteration,
  type Judgement,
  type Reward,
  type TrainingState,
} from "./trainer";
import type { Objects } from "./verify/header";
import type { ProblemKey } from "./verify/problem";
import type { Verdict } from "./verify/verify";

export interface Load {
  kind: "load";
  site: string; // address of the site's folder
  hasPython: boolean;
  isTeam: boolean; // as many threads as the page may have
}

/** A car that has learned already drives until a training begins. */
export interface Show {
  kind: "show";
  plan: Plan;
  track: TrackFile;
}

/** That car is not to be looked at any more. */
export interface Hide {
  kind: "hide";
}

export interface Check {
  kind: "check";
  question: number;
  source: string;
  track: TrackFile;
  among: Among; // what it is tried with
}

/** What a preset pays along a track is to be painted. */
export interface Paint {
  kind: "paint";
  question: number;
  reward: string;
  track: TrackFile;
  among: Among;
}

export interface Start {
  kind: "train";
  plan: Plan;
  race: RacePlan;
  policy: Policy;
  objects: Objects;
  track: TrackFile;
  reward: string; // name of a preset, or the source where there is Python
  seed: number;
  begin: Beginning | undefined; // fresh weights without one
  most: number; // camera steps
}

export interface Verify {
  kind: "verify";
  plan: Plan;
  file: File; // of anybody
}

/** A model that came from elsewhere drives its evaluation. */
export interface Judge {
  kind: "judge";
  plan: Plan;
  race: RacePlan;
  policy: Policy;
  objects: Objects;
  track: TrackFile;
  seed: number;
  begin: Beginning;
}

/** The laps of a model's evaluation are to be watched. */
export interface LookAtLaps extends Omit<Judge, "kind"> {
  kind: "laps";
  reward: string | undefined; // the preset that it was trained with
}

/** The laps of the replay that was found genuine are to be watched. */
export interface LookAtReplay {
  kind: "watch";
  plan: Plan;
}

/** What the car saw in a lap of those. */
export interface LookThrough {
  kind: "eyes";
  lap: number;
}

/** What a reward in Python pays for laps. */
export interface PayLaps {
  kind: "pay";
  source: string;
  track: TrackFile;
  laps: ToPay[];
}

/** Somebody takes the wheel, of the only car of this thread. */
export interface SitDown {
  kind: "sit";
  id: string;
  plan: Plan;
  track: TrackFile;
  settings: Settings;
}

export interface DriveOn {
  kind: "steer";
  controls: { steering: number; speed: number; steps: number }; // rad, m/s, of 1/15 s
}

type Asked = Load | Show | Hide | Check | Paint | Start | Verify | Judge | SitDown | DriveOn | Watching;
type Watching = LookAtLaps | LookAtReplay | LookThrough | PayLaps;

export type Report =
  | { kind: "ready" } // all that was asked for is loaded
  | { kind: "unloaded"; message: string } // some of it did not come
  | { kind: "checked"; question: number; verdict: RewardVerdict }
  | { kind: "painting" }
  | { kind: "painted"; question: number; painting: RewardPainting }
  | { kind: "loaded"; isSlow: boolean; threads: number }
  | { kind: "paying"; isPaying: boolean } // rewards are computed from here on, or no longer
  | { kind: "printed"; text: string }
  | { kind: "look"; look: Look; picture: Picture }
  | { kind: "iteration"; iteration: Iteration; seconds: number }
  | {
      kind: "evaluation";
      evaluation: Evaluation;
      steps: number;
      seconds: number;
      state: TrainingState;
      judgement: Judgement;
    }
  | { kind: "ended"; isReached: boolean }
  | { kind: "judged"; evaluation: Evaluation }
  | { kind: "seated"; drive: Drive }
  | { kind: "steered"; state: DriveState; trace: Trace }
  | { kind: "verified"; verdict: Verdict }
  | { kind: "laps"; found: EvaluationLaps; toPay: ToPay[] }
  | { kind: "eyes"; lap: number; eyes: Eyes | undefined }
  | { kind: "paid"; rewards: (number | null)[][]; isAfresh: boolean }
  | { kind: "unreadable"; key: ProblemKey; values: Record<string, string | number> }
  | { kind: "failed"; message: string; isReward: boolean };

const OFTEN = 66; // ms between two looks, and of a step

const tell = (report: Report) => postMessage(report);

interface Loaded {
  site: string;
  core: LoadedCore;
  python: Python | undefined;
  presets: Record<string, Reward>;
}

let loading: Promise<Loaded> | undefined;
onmessage = ({ data }: MessageEvent<Asked>) => {
  handle(data).catch((error: Error) =>
    tell({ kind: "failed", message: error.message, isReward: error instanceof RewardFailure }),
  );
};

async function handle(asked: Asked): Promise<void> {
  if (asked.kind === "load") {
    loading = load(asked);
    loading.then(
      () => tell({ kind: "ready" }),
      (error: Error) => tell({ kind: "unloaded", message: error.message }),
    );
    return;
  }
  const loaded = await loading!;
  if (asked.kind === "check") await check(asked, loaded);
  else if (asked.kind === "paint") {
    const { reward, track } = asked;
    await painted(
      asked,
      loaded.core,
      () => payWith(loaded.presets[reward]!, track, 1),
      () => {},
    );
  } else if (asked.kind === "show") await show(asked, loaded);
  else if (asked.kind === "hide") leave();
  else if (asked.kind === "verify") await prove(asked, loaded);
  else if (asked.kind === "judge")
    tell({
      kind: "judged",
      evaluation: new Trainer(loaded.core.core, asked, () => () => new Float64Array()).evaluate(),
    });
  else if (asked.kind === "laps") await lookAtLaps(asked, loaded);
  else if (asked.kind === "watch") lookAtReplay(await toWatch!());
  else if (asked.kind === "eyes") tell({ kind: "eyes", lap: asked.lap, eyes: await watched!.eyes(asked.lap) });
  else if (asked.kind === "pay") await payFor(asked, loaded);
  else if (asked.kind === "sit") sit(asked, loaded);
  else if (asked.kind === "steer") {
    const { steering, speed, steps } = asked.controls;
    tell({ kind: "steered", ...driven!.step(steering, speed, steps) });
  } else train(asked, loaded);
}

/** What is wrong with a reward, and then, where nothing is, its painting. */
async function check({ question, source, track, among }: Check, { core, python }: Loaded): Promise<void> {
  const situations = momentsAmong(core.core, track, among);
  const verdict = python!.check(source, { waypoints: track.waypoints, situations });
  tell({ kind: "checked", question, verdict });
  const open = () => python!.open(source, track, 1, situations[0]!.row.length, 0).pay;
  if (verdict.ok) await painted({ question, track, among }, core, open, () => tell({ kind: "painting" }));
}

let newest = 0; // of the questions for paintings; a training is one, too
async function painted(
  { question, track, among }: Pick<Paint, "question" | "track" | "among">,
  { core }: LoadedCore,
  open: () => Pay,
  sign: () => void, // of life, before every lap
): Promise<void> {
  newest = question;
  const { paint } = await import("./painting");
  const isWanted = async () => {
    await new Promise((goOn) => setTimeout(goOn)); // newer questions have their turn
    if (newest !== question) return false;
    sign();
    return true;
  };
  const painting = await paint(open, core, track, among, isWanted);
  if (painting) tell({ kind: "painted", question, painting });
}

let shown: { car: ShownCar; timer: number } | undefined;
let starter: Promise<Float32Array> | undefined;
async function show({ plan, track }: Show, { site, core: { core } }: Loaded): Promise<void> {
  const weights = await (starter ??= shownWeights(site)).catch(() => undefined);
  if (!weights) return; // is only there to be looked at
  leave();
  const [car, race] = [new ShownCar(core, plan, track, weights), plan.races["time-trial"]];
  const drive = () => {
    car.step();
    tell({ kind: "look", ...lookOf(car, { plan, race }) });
  };
  shown = { car, timer: setInterval(drive, OFTEN) as unknown as number };
}

function leave(): void {
  clearInterval(shown?.timer);
  shown?.car.free();
  shown = undefined;
}

let driven: DrivenCar | undefined;
function sit({ id, plan, track, settings }: SitDown, { core: { core } }: Loaded): void {
  driven?.free();
  driven = new DrivenCar(core, plan, track, settings);
  tell({ kind: "seated", drive: driven.begin(id) });
}

/** Drive a replay again; what that needs is loaded now. */
async function prove({ plan, file }: Verify, { core: { core }, site }: Loaded): Promise<void> {
  const { ReplayProblem, verifyFile } = await import("./verify/verify");
  const track = (name: string) => readTrack(site, name);
  try {
    const verdict = await verifyFile(core, plan, file, track, (replay, road) => {
      toWatch = async () => (await import("./laps/watched")).Watched.replay(core, plan, replay, road);
    });
    tell({ kind: "verified", verdict });
  } catch (error) {
    if (!(error instanceof ReplayProblem)) throw error;
    tell({ kind: "unreadable", key: error.key, values: error.values });
  }
}

let watched: Watched | undefined;
let toWatch: (() => Promise<Watched>) | undefined;
async function lookAtLaps(asked: LookAtLaps, { core: { core }, presets }: Loaded): Promise<void> {
  const [{ Watched }, { payLaps }] = await Promise.all([import("./laps/watched"), import("./laps/paid")]);
  watched = await Watched.evaluation(core, { ...asked, kind: "judge" });
  const { reward, track } = asked;
  const preset = reward === undefined ? undefined : presets[reward]!;
  const toPay = watched.toPay();
  if (preset) watched.pay(payLaps(payWith(preset, track, 1), toPay), preset.remembers);
  tell({ kind: "laps", found: watched.report, toPay: preset ? [] : toPay });
}

function lookAtReplay(replay: Watched): void {
  watched = replay;
  tell({ kind: "laps", found: watched.report, toPay: [] });
}

async function payFor({ source, track, laps }: PayLaps, { python }: Loaded): Promise<void> {
  const { payLaps } = await import("./laps/paid");
  const width = laps.flatMap(({ rows }) => rows)[0]?.length ?? 0;
  const own = width ? python!.open(source, track, 1, width, 0) : undefined;
  tell({ kind: "paid", rewards: own ? payLaps(own.pay, laps) : [], isAfresh: own?.remembers ?? false });
}

async function load({ site, hasPython, isTeam }: Load): Promise<Loaded> {
  const address = new URL("data/rewards.js", site).href;
  const [core, { rewards }, python] = await Promise.all([
    loadCore(
      async (file) => (await read(site, `core/${file}`)).arrayBuffer(),
      isTeam ? availableThreads() : 1,
      () => openUnderPolicy(helperAddress),
    ),
    import(/* @vite-ignore */ address) as Promise<{ rewards: Record<string, Reward> }>,
    hasPython ? Python.load(site) : undefined,
  ]);
  if (python) leaveAlone();
  return { site, core, presets: rewards, python };
}

function train(start: Start, { core: { core, isSlow, threads }, python, presets }: Loaded): void {
  leave();
  newest = 0;
  const began = performance.now();
  const seconds = () => (performance.now() - began) / 1000;
  const { plan, race, policy, objects, track, reward, seed, begin } = start;
  const numCars = race.cars["num_envs"]!;
  let printed = () => "";
  const payFor = (numColumns: number): Pay => {
    if (!python) return payWith(presets[reward]!, track, numCars);
    tell({ kind: "paying", isPaying: true }); // what stands outside of the function may hang, too
    const paid = python.open(reward, track, numCars, numColumns, seed);
    tell({ kind: "paying", isPaying: false });
    printed = paid.printed;
    return paid.pay;
  };
  const trainer = new Trainer(core, { plan, race, policy, objects, track, seed, begin }, payFor);
  tell({ kind: "loaded", isSlow, threads });
  let looked = -Infinity;
  const look = () => {
    if (performance.now() - looked < OFTEN) return;
    looked = performance.now();
    tell({ kind: "look", ...lookOf(trainer, start) });
  };
  const say = () => {
    const text = printed();
    if (text) tell({ kind: "printed", text });
  };
  while (trainer.steps < start.most) {
    tell({ kind: "paying", isPaying: true });
    try {
      trainer.drive(look);
    } finally {
      say();
    }
    tell({ kind: "paying", isPaying: false });
    tell({ kind: "iteration", iteration: trainer.learn(), seconds: seconds() });
    if (!trainer.needsEvaluation) continue;
    const evaluation = trainer.evaluate();
    const [state, judgement] = [trainer.state(), trainer.judgement(evaluation)];
    tell({ kind: "evaluation", evaluation, steps: trainer.steps, seconds: seconds(), state, judgement });
    if (evaluation.lapTimes.length >= race.laps) return tell({ kind: "ended", isReached: true });
  }
  tell({ kind: "ended", isReached: false });
}

/** This moment and what the foremost car sees, as the console's server streams them. */
function lookOf(
  { cars, columns, steps }: Pick<Trainer, "cars" | "columns" | "steps">,
  { plan, race }: Pick<Start, "plan" | "race">,
): { look: Look; picture: Picture } {
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
    look: {
      step: steps,
      objects: objectsOf(rows.subarray(focus * rowWidth, (focus + 1) * rowWidth), columns.length, plan),
      poses,
      steps: all.map((car) => column("steps", car)),
      policy: [],
      is_discrete: true,
      focus,
    },
    picture: { frame: btoa(frame), frame_shape: [race.cars["height"]!, race.cars["width"]!] },
  };
}
