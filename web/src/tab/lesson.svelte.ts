/** A training as the page sees it: the worker that runs it, and what it has told so far. */
import { Curves, type Point } from "../lib/curves";
import type { Look } from "../lib/poses";
import type { Plan, TrackFile } from "./plan";
import type { Report, Start } from "./worker";
import TrainingWorker from "./worker?worker";

const LAPS = 5;
const MOST = 400_000; // camera steps

export type State = "ready" | "loading" | "learning" | "reached" | "unreached" | "stopped" | "failed";

export interface Judged {
  laps: number;
  trials: number;
  bestLap: number | null; // s
  steps: number;
  seconds: number;
  weights: Float32Array;
}

export class Lesson {
  state = $state<State>("ready");
  look = $state.raw<Look | undefined>();
  judged = $state.raw<Judged | undefined>();
  curves = $state.raw(new Curves());
  version = $state(0); // of the curves
  seconds = $state(0);
  isSlow = $state(false);
  failure = $state("");
  private worker: Worker | undefined;

  constructor(
    private readonly site: string,
    private readonly plan: Plan,
  ) {
    this.load();
  }

  get isRunning(): boolean {
    return this.state === "loading" || this.state === "learning";
  }

  /** Compile the core while the user reads. */
  private load(): Worker {
    this.worker = new TrainingWorker();
    this.worker.onmessage = ({ data }: MessageEvent<Report>) => this.hear(data);
    this.worker.onerror = ({ message }) => this.hear({ kind: "failed", message: message || "worker" });
    this.worker.postMessage({ site: this.site });
    return this.worker;
  }

  train(track: TrackFile, reward: string, seed: number): void {
    [this.look, this.judged, this.seconds, this.failure] = [undefined, undefined, 0, ""];
    [this.curves, this.state] = [new Curves(), "loading"];
    this.version++;
    const start: Start = { site: this.site, plan: this.plan, track, reward, seed, laps: LAPS, most: MOST };
    this.worker!.postMessage(start);
  }

  stop(): void {
    this.end("stopped");
  }

  private end(state: State): void {
    this.worker?.terminate();
    this.load();
    this.state = state;
  }

  private hear(report: Report): void {
    switch (report.kind) {
      case "loaded":
        [this.isSlow, this.state] = [report.isSlow, "learning"];
        break;
      case "look":
        this.look = report.look;
        break;
      case "iteration": {
        const { steps, completion } = report.iteration;
        this.add({ kind: "iteration", step: steps, seconds: report.seconds, completion });
        break;
      }
      case "evaluation": {
        const { completions, lapTimes, weights } = report.evaluation;
        const { steps, seconds } = report;
        const bestLap = lapTimes.length ? Math.min(...lapTimes) : null;
        this.judged = { laps: lapTimes.length, trials: completions.length, bestLap, steps, seconds, weights };
        this.add({ kind: "evaluation", step: steps, seconds, completions, lap_times: lapTimes });
        break;
      }
      case "ended":
        this.end(report.isReached ? "reached" : "unreached");
        break;
      case "failed":
        this.failure = report.message;
        this.end("failed");
    }
  }

  private add(point: Point): void {
    this.curves.add([point]);
    this.seconds = point.seconds;
    this.version++;
  }
}
