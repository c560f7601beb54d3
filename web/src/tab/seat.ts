/** Who keeps the car that somebody drives in this tab: a worker of its own, so that a training goes on beside it. */
import type { Drive, DriveState, Ghost, GhostCard, Seat, Settings } from "../api/drives";
import type { Trace } from "./drivencar";
import type { Model } from "./model";
import { openWorker } from "./open";
import type { Plan, TrackFile } from "./plan";
import { drivenLap, keepLap, type DrivenLap } from "./shelf";
import type { DriveOn, Load, Report, SitDown } from "./worker";

const YOU = "you";
const LEARNED: Settings = { direction: "forward", vehicle: "v5" }; // all that learned in a page

export class TabSeat implements Seat {
  readonly hasGhosts = true;
  private readonly worker = openWorker();
  private readonly asked: { answer: (report: Report) => void; fail: (error: Error) => void }[] = [];
  private settings: Settings = { vehicle: "v5", direction: "forward" };
  private round = 0;
  private unkept: DrivenLap | undefined; // a best lap for which the browser had no room

  constructor(
    site: string,
    private readonly plan: Plan,
    private readonly track: TrackFile,
    private readonly models: Model[],
    /** Is told why a lap could not be kept. */ private readonly onUnkept: (error: unknown) => void,
  ) {
    this.worker.onmessage = ({ data }: MessageEvent<Report>) => this.hear(data);
    this.worker.onerror = ({ message }) => this.hear({ kind: "failed", message: message || "worker", isReward: false });
    this.worker.postMessage({ kind: "load", site, hasPython: false, isTeam: false } satisfies Load);
  }

  /** Answers come in the order of the questions. */
  private hear(report: Report): void {
    if (report.kind === "ready") return;
    const asked = this.asked.shift();
    if (report.kind === "failed") asked?.fail(new Error(report.message));
    else asked?.answer(report);
  }

  private ask(question: SitDown | DriveOn): Promise<Report> {
    return new Promise((answer, fail) => {
      this.asked.push({ answer, fail });
      this.worker.postMessage(question);
    });
  }

  async begin(settings: Settings): Promise<Drive> {
    this.settings = { ...settings };
    const { plan, track } = this;
    const id = String(++this.round);
    const report = await this.ask({ kind: "sit", id, plan, track, settings: this.settings });
    const best = await this.best();
    const { drive } = report as Extract<Report, { kind: "seated" }>;
    // the plan knows the medals of the car and the direction of the page's own trainings
    const isUsual = settings.vehicle === LEARNED.vehicle && settings.direction === LEARNED.direction;
    const medals = (isUsual && plan.medals[track.geometry.name]) || null;
    return { ...drive, best: best?.seconds ?? null, medals };
  }

  async step(_id: string, controls: { steering: number; speed: number; steps: number }): Promise<DriveState> {
    const { state, trace } = (await this.ask({ kind: "steer", controls })) as Extract<Report, { kind: "steered" }>;
    const { finished } = state;
    if (!finished || !trace.length) return state;
    const best = await this.best();
    if (best && best.seconds <= finished.seconds) return state;
    const lap = { key: this.key, seconds: finished.seconds, trace };
    await keepLap(lap).catch((error: unknown) => {
      this.unkept = lap;
      this.onUnkept(error);
    });
    return { ...state, finished: { ...finished, is_best: true } };
  }

  end(): void {
    // the next drive takes the worker's place
  }

  /** The car is left for good. */
  leave(): void {
    this.worker.terminate();
  }

  async ghosts(): Promise<GhostCard[]> {
    const own = await this.best();
    const cards = this.raced.map(({ name, bestLap }) => ({
      key: `model:${name}`,
      name,
      seconds: bestLap!,
      ...LEARNED,
    }));
    cards.sort((a, b) => a.seconds - b.seconds);
    return [...(own ? [{ key: YOU, name: "", seconds: own.seconds, ...this.settings }] : []), ...cards];
  }

  async ghost(key: string): Promise<Ghost> {
    if (key === YOU) {
      const { seconds, trace } = (await this.best())!;
      return { key, name: "", seconds, trace, ...this.settings };
    }
    const { name, bestLap, trace } = this.raced.find((one) => `model:${one.name}` === key)!;
    return { key, name, seconds: bestLap!, trace: trace as Trace, ...LEARNED };
  }

  /** One's own fastest lap so far. */
  private async best(): Promise<DrivenLap | undefined> {
    const stored = await drivenLap(this.key).catch(() => undefined);
    const { unkept } = this;
    return unkept?.key === this.key && !(stored && stored.seconds < unkept.seconds) ? unkept : stored;
  }

  /** Models that lapped this track. */
  private get raced(): Model[] {
    return this.models.filter(({ track, trace }) => track === this.track.geometry.name && trace?.length);
  }

  private get key(): string {
    const { geometry, digest } = this.track;
    // a drawn road may change under its name
    const road = this.plan.tracks.includes(geometry.name) ? geometry.name : digest;
    return [road, this.settings.vehicle, this.settings.direction].join("/");
  }
}
