/** A training as the page sees it: the workers, one of them with Python, and what they have told so far. */
import type { ActionPreset, RewardPainting, RewardVerdict } from "../api/client";
import { Curves, type Point } from "../lib/curves";
import type { Look, Picture } from "../scene/poses";
import { policyOf, type Model } from "./model";
import { countOf } from "./objects";
import type { Trace } from "./drivencar";
import type { Judgement, TrainingState } from "./trainer";
import type { Plan, RaceType, TrackFile } from "./plan";
import { policyFor } from "./policy";
import type { Objects } from "./verify/header";
import type { Among } from "./among";
import type { Check, Hide, Load, Paint, Report, Show, Start } from "./worker";
import { openWorker } from "./open";
import { l } from "./text";

const MOST = { alone: 400_000, among: 3_000_000 }; // camera steps
const PATIENCE = 5; // s that a reward function may take for a step of all cars
const TICKS = 2; // a second
const MOST_PRINTED = 20_000; // characters

type Kind = "plain" | "python";

/** A training that somebody asks for. */
export interface Wish {
  track: TrackFile;
  reward: string; // a preset's name
  space: ActionPreset;
  type: RaceType;
  objects: Objects;
  seed: number;
  from: Model | undefined; // whose weights it begins with
  source: string | undefined; // of a reward of one's own, instead of the preset
}

const refusal = (message: string): RewardVerdict => ({
  ok: false,
  problems: [{ line: 1, column: 1, severity: "error", message, hint: "" }],
  situations: [],
  painting: null,
  laps: [],
});

/** A check that has no answer yet. */
interface Asked {
  question: number;
  answer: (verdict: RewardVerdict) => void;
  timer: number | undefined;
  post: () => void;
}

export type State = "ready" | "loading" | "learning" | "reached" | "unreached" | "stopped" | "failed";

export interface Judged {
  laps: number;
  trials: number;
  bestLap: number | null; // s
  steps: number;
  seconds: number;
  weights: Float32Array;
  trace: Trace;
  state: TrainingState;
  judgement: Judgement;
}

export class Lesson {
  state = $state<State>("ready");
  look = $state.raw<Look | undefined>();
  picture = $state.raw<Picture | undefined>();
  judged = $state.raw<Judged | undefined>();
  curves = $state.raw(new Curves());
  version = $state(0); // of the curves
  seconds = $state(0);
  isSlow = $state(false);
  threads = $state(1);
  failure = $state("");
  failedReward = $state(""); // what a reward of one's own did wrong
  failedSource = $state(""); // its text
  printed = $state(""); // by it, the last of it
  isPythonReady = $state(false);
  pythonFailure = $state(""); // why it did not come; it is asked for again when it is needed again
  painting = $state.raw<RewardPainting | undefined>(); // of the reward that was asked for last
  private readonly workers: Partial<Record<Kind, Worker>> = {};
  private running: Kind = "plain";
  private isShown = false; // a car until somebody trains; of one that is not, a last picture may still be on its way
  private asked: Asked | undefined;
  private questions = 0; // so far
  private painted = 0; // the question whose painting is waited for
  private painter: number | undefined; // ends one that hangs
  private started: Start | undefined; // what the worker was asked to train
  private quiet = 0; // ticks since a running reward was heard of
  private watch: number | undefined;

  constructor(
    private readonly site: string,
    private readonly plan: Plan,
    private readonly onready: () => void,
  ) {
    this.load("plain");
  }

  get isRunning(): boolean {
    return this.state === "loading" || this.state === "learning";
  }

  /** Have Python there when it is needed. */
  preparePython(): void {
    if (!this.workers.python) this.load("python");
  }

  /** Compile the core, or the core and Python, while the user reads. */
  private load(kind: Kind): void {
    this.workers[kind]?.terminate();
    const worker = (this.workers[kind] = openWorker());
    worker.onmessage = ({ data }: MessageEvent<Report>) => this.hear(data, kind);
    worker.onerror = ({ message: said }) => {
      const message = said || "worker";
      if (kind === "python" && !this.isPythonReady) this.hear({ kind: "unloaded", message }, kind);
      else this.hear({ kind: "failed", message, isReward: false }, kind);
    };
    if (kind === "python") [this.isPythonReady, this.pythonFailure] = [false, ""];
    const asked = { site: this.site, hasPython: kind === "python", isTeam: true };
    worker.postMessage({ kind: "load", ...asked } satisfies Load);
  }

  /** Until somebody trains, a car that has learned already drives; not for who wants nothing to move. */
  show(track: TrackFile): void {
    if (this.isRunning) return;
    this.hide();
    if (this.state !== "ready" || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    this.isShown = true;
    this.workers.plain!.postMessage({ kind: "show", plan: this.plan, track } satisfies Show);
  }

  /** Of a track that is not the chosen one any more: the car that drives there, also of a training that is over. */
  hide(): void {
    if (this.isRunning) return;
    [this.look, this.picture, this.isShown] = [undefined, undefined, false];
    this.workers.plain!.postMessage({ kind: "hide" } satisfies Hide);
  }

  /** What is wrong with a reward function, among the objects of a race; what does not answer is ended. While the worker trains, the question waits. */
  check(source: string, track: TrackFile, type: RaceType, objects: Objects): Promise<RewardVerdict> {
    this.preparePython();
    return new Promise((answer) => {
      const question = (this.painted = ++this.questions);
      const post = () => {
        clearTimeout(this.asked?.timer);
        const among = this.among(type, objects);
        const asked = { kind: "check", question, source, track: $state.snapshot(track), among } satisfies Check;
        this.workers.python!.postMessage(asked);
        this.asked!.timer = window.setTimeout(() => {
          answer(refusal(`The reward function did not return within ${PATIENCE} s.`));
          this.asked = undefined;
          if (this.isTraining("python")) this.hang();
          else this.load("python");
        }, 1000 * PATIENCE);
      };
      clearTimeout(this.asked?.timer);
      this.asked = { question, answer, timer: undefined, post };
      if (this.isPythonReady && !this.isTraining("python")) post();
    });
  }

  private among(type: RaceType, objects: Objects): Among {
    const { vehicle, statuses, objectColumns, races } = this.plan;
    return { objects, trials: races[type].trials, vehicle, statuses, objectColumns };
  }

  /** Paint what a preset pays along a track among the objects of a race, while nothing trains. */
  paint(reward: string, track: TrackFile, type: RaceType, objects: Objects): void {
    const [question, among] = [(this.painted = ++this.questions), this.among(type, objects)];
    const asked = { kind: "paint", question, reward, track: $state.snapshot(track), among } satisfies Paint;
    this.workers.plain!.postMessage(asked);
  }

  /** Of a reward that is not shown any more. */
  forgetPainting(): void {
    [this.painting, this.painted] = [undefined, 0];
  }

  /** `source`: of a reward of one's own, instead of a preset. */
  train({ track, reward, space, type, objects, seed, source, from }: Wish): void {
    [this.look, this.picture, this.judged] = [undefined, undefined, undefined];
    [this.seconds, this.failure] = [0, ""];
    [this.failedReward, this.printed] = ["", ""];
    [this.curves, this.state] = [new Curves(), "loading"];
    this.version++;
    this.running = source === undefined ? "plain" : "python";
    if (source !== undefined) {
      this.workers.plain!.postMessage({ kind: "hide" } satisfies Hide);
      this.preparePython();
    }
    const { plan } = this;
    const race = plan.races[type];
    const policy = policyFor(race, space, objects);
    const most = countOf(objects) ? MOST.among : MOST.alone;
    const begin = from && { weights: from.weights, layout: policyOf(from, plan).weights };
    const asked = { plan, race, policy, objects, track, seed, begin };
    const start: Start = { kind: "train", ...asked, reward: source ?? reward, most };
    this.started = start;
    this.workers[this.running]!.postMessage(start);
  }

  stop(): void {
    this.end("stopped");
  }

  /** A function that answered in its situations may hang elsewhere on the track: what waits behind it is asked anew. */
  private awaitLap(): void {
    clearTimeout(this.painter);
    this.painter = window.setTimeout(() => {
      clearTimeout(this.asked?.timer);
      this.load("python");
      if (this.isTraining("python")) this.workers.python!.postMessage(this.started!);
    }, 1000 * PATIENCE);
  }

  private isTraining(kind: Kind): boolean {
    return this.isRunning && this.running === kind;
  }

  private blame(message: string): void {
    [this.failedReward, this.failedSource] = [message, this.started?.reward ?? ""];
  }

  private hang(): void {
    this.blame(`reward_function.py: the reward function did not return within ${PATIENCE} s.`);
    this.end("failed");
  }

  private end(state: State): void {
    this.attend(false);
    this.load(this.running);
    this.state = state;
  }

  /** Whether a reward of one's own runs, and must be heard of. Ticks, so that the time of a sleeping computer is none. */
  private attend(isPaying: boolean): void {
    clearInterval(this.watch);
    this.quiet = 0;
    if (!isPaying || this.running === "plain") return;
    this.watch = window.setInterval(() => {
      if (++this.quiet >= PATIENCE * TICKS) this.hang();
    }, 1000 / TICKS);
  }

  private hear(report: Report, kind: Kind): void {
    if (kind === this.running) this.quiet = 0; // another worker's life says nothing of a reward that hangs in this one
    switch (report.kind) {
      case "ready":
        if (kind === "python") {
          this.isPythonReady = true;
          if (!this.isTraining("python")) this.asked?.post();
        } else this.onready();
        break;
      case "unloaded":
        if (kind === "plain") break; // is told when something is asked of it
        this.pythonFailure = report.message;
        this.workers.python!.terminate();
        delete this.workers.python;
        if (this.isTraining("python")) this.end("failed");
        break;
      case "checked":
        if (report.question !== this.asked?.question) break; // of a text that has changed meanwhile
        clearTimeout(this.asked.timer);
        this.asked.answer(report.verdict);
        this.asked = undefined;
        clearTimeout(this.painter);
        if (report.verdict.ok) this.awaitLap();
        else this.painting = undefined;
        break;
      case "painting":
        this.awaitLap();
        break;
      case "painted":
        clearTimeout(this.painter);
        if (report.question === this.painted) this.painting = report.painting;
        break;
      case "paying":
        this.attend(report.isPaying);
        break;
      case "printed":
        this.printed = (this.printed + report.text).slice(-MOST_PRINTED);
        break;
      case "loaded":
        clearTimeout(this.painter);
        [this.isSlow, this.threads, this.state] = [report.isSlow, report.threads, "learning"];
        break;
      case "look":
        if (kind === this.running && (this.state === "learning" || (this.isShown && !this.isRunning)))
          [this.look, this.picture] = [report.look, report.picture];
        break;
      case "iteration": {
        const { steps, completion } = report.iteration;
        this.add({ kind: "iteration", step: steps, seconds: report.seconds, completion });
        break;
      }
      case "evaluation": {
        const { completions, lapTimes, weights, trace } = report.evaluation;
        const { steps, seconds, state, judgement } = report;
        const bestLap = lapTimes.length ? Math.min(...lapTimes) : null;
        this.judged = {
          laps: lapTimes.length,
          trials: completions.length,
          bestLap,
          steps,
          seconds,
          weights,
          trace,
          state,
          judgement,
        };
        this.add({ kind: "evaluation", step: steps, seconds, completions, lap_times: lapTimes });
        break;
      }
      case "ended":
        this.end(report.isReached ? "reached" : "unreached");
        break;
      case "failed":
        if (kind === "python" && !this.isTraining("python")) return this.give(report.message);
        if (report.isReward) this.blame(report.message);
        else this.failure = report.message;
        this.end("failed");
    }
  }

  /** What broke Python itself while a reward was checked or painted: no training that runs beside it ends by that. */
  private give(message: string): void {
    clearTimeout(this.painter);
    clearTimeout(this.asked?.timer);
    this.asked?.answer(refusal(l("python_broken", { why: message })));
    this.asked = undefined;
    this.load("python");
  }

  private add(point: Point): void {
    this.curves.add([point]);
    this.seconds = point.seconds;
    this.version++;
  }
}
