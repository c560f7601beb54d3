/** Laps that somebody watches, and the workers that drive them again and pay for them. */
import type { EvaluationLaps } from "../../lib/laps";
import type { Picture } from "../../scene/poses";
import { policyOf, type Model } from "../model";
import { openWorker } from "../open";
import type { Plan, TrackFile } from "../plan";
import { l } from "../text";
import type { Load, LookAtLaps, LookAtReplay, LookThrough, PayLaps, Report, Verify } from "../worker";
import type { ToPay } from "./paid";

const PATIENCE = 60_000; // ms that loading Python and paying for all laps may take

type Question = LookAtLaps | LookAtReplay | LookThrough | PayLaps | Verify;
type Answer<K> = Extract<Report, { kind: K }>;

/** A worker that is asked one thing after the other. */
class Asked {
  private readonly worker = openWorker();
  private last: Promise<unknown> = Promise.resolve();

  constructor(site: string, hasPython: boolean) {
    this.worker.postMessage({ kind: "load", site, hasPython, isTeam: false } satisfies Load);
  }

  ask<K extends Report["kind"]>(question: Question, kind: K): Promise<Answer<K>> {
    const answer = this.last.then(
      () =>
        new Promise<Answer<K>>((done, failed) => {
          this.worker.onerror = ({ message }) => failed(new Error(message || "worker"));
          this.worker.onmessage = ({ data }: MessageEvent<Report>) => {
            if (data.kind === kind) done(data as Answer<K>);
            else if (data.kind === "failed") failed(new Error(data.message));
            else if (data.kind === "unreadable") failed(new Error(l(data.key, data.values)));
          };
          this.worker.postMessage(question);
        }),
    );
    this.last = answer.catch(() => undefined);
    return answer;
  }

  end(): void {
    this.worker.terminate();
  }
}

export class Viewing {
  found = $state.raw<EvaluationLaps>()!;
  private payer: Asked | undefined;

  private constructor(
    readonly name: string,
    private readonly worker: Asked,
    found: EvaluationLaps,
  ) {
    this.found = found;
  }

  /** The evaluation of a model, driven once more. */
  static async model(site: string, plan: Plan, model: Model, track: TrackFile): Promise<Viewing> {
    const { type, objects } = model.race ?? { type: "time-trial", objects: { obstacles: null, bots: null } };
    const policy = policyOf(model, plan);
    const begin = { weights: model.weights, layout: policy.weights };
    const preset = plan.rewards.find(({ source }) => source === model.reward);
    const asked = { plan, race: plan.races[type], policy, objects, track, seed: model.seed, begin };
    const worker = new Asked(site, false);
    try {
      const { found, toPay } = await worker.ask({ kind: "laps", ...asked, reward: preset?.name }, "laps");
      const viewing = new Viewing(model.name, worker, found);
      if (!preset) void viewing.pay(site, model.reward, track, toPay);
      return viewing;
    } catch (error) {
      worker.end();
      throw error;
    }
  }

  /** The laps of a replay, once it was found genuine. */
  static async replay(site: string, plan: Plan, file: File): Promise<Viewing> {
    const worker = new Asked(site, false);
    try {
      await worker.ask({ kind: "verify", plan, file }, "verified");
      const { found } = await worker.ask({ kind: "watch", plan }, "laps");
      const reward = { ...found.reward, error: l("watch_unpaid") };
      return new Viewing(file.name.slice(0, 80), worker, { ...found, reward });
    } catch (error) {
      worker.end();
      throw error;
    }
  }

  /** What the car saw in a lap, by its rows. */
  async eyes(lap: number): Promise<(row: number) => Picture | undefined> {
    const { eyes } = await this.worker.ask({ kind: "eyes", lap }, "eyes");
    if (!eyes) return () => undefined;
    const { frames, shape } = eyes;
    const size = shape[0] * shape[1];
    return (row) => ({
      frame: btoa(String.fromCharCode(...frames.subarray(row * size, (row + 1) * size))),
      frame_shape: shape,
    });
  }

  end(): void {
    this.worker.end();
    this.payer?.end();
  }

  /** A reward of one's own pays in a worker of its own, which may hang. */
  private async pay(site: string, source: string, track: TrackFile, laps: ToPay[]): Promise<void> {
    const say = (error: string) => (this.found = { ...this.found, reward: { ...this.found.reward, error } });
    say(l("python_loading"));
    const payer = (this.payer = new Asked(site, true));
    let timer: number | undefined;
    const late = new Promise<never>((_, failed) => {
      timer = window.setTimeout(() => failed(new Error(l("watch_late"))), PATIENCE);
    });
    try {
      const { rewards, isAfresh } = await Promise.race([payer.ask({ kind: "pay", source, track, laps }, "paid"), late]);
      const paid = this.found.laps.map((lap, at) => ({ ...lap, reward: rewards[at]! }));
      this.found = { ...this.found, laps: paid, reward: { ...this.found.reward, error: null, is_afresh: isAfresh } };
    } catch (error) {
      say(error instanceof Error ? error.message.split("\n")[0]! : String(error));
    } finally {
      clearTimeout(timer);
      payer.end();
    }
  }
}
