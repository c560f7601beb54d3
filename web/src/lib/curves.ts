/** A training's curves: points arrive in pages and in a stream, and are never counted twice. */
import { count, fixed, percent, short } from "./numbers";

export interface Point {
  kind: "iteration" | "evaluation" | "note";
  step: number;
  seconds: number;
  [name: string]: unknown;
}

const MAX_POINTS = 4000; // of a kind; beyond it every other one is dropped, so that a tab open for hours stays small
const MAX_NOTES = 500; // the newest

export class Curves {
  iterations: Point[] = [];
  evaluations: Point[] = [];
  notes: Point[] = [];

  /** Add points in the order they were written; a run that was set back writes its later points again. */
  add(points: Point[]): void {
    for (const point of points) {
      const list =
        point.kind === "evaluation" ? this.evaluations : point.kind === "note" ? this.notes : this.iterations;
      while (list.length && list[list.length - 1]!.step >= point.step && point.kind !== "note") list.pop();
      list.push(point);
    }
    if (this.iterations.length > MAX_POINTS) this.iterations = thinned(this.iterations);
    if (this.evaluations.length > MAX_POINTS) this.evaluations = thinned(this.evaluations, this.best);
    if (this.notes.length > MAX_NOTES) this.notes.splice(0, this.notes.length - MAX_NOTES);
  }

  get last(): Point | undefined {
    return this.iterations[this.iterations.length - 1];
  }

  /** The best evaluation so far. */
  get best(): Point | undefined {
    return this.evaluations.findLast((point) => point["is_best"] === true);
  }
}

/** No more than are drawn; both ends stay, and one that is not to be missed. */
function thinned(points: Point[], best?: Point): Point[] {
  let found = points;
  while (found.length > MAX_POINTS) {
    const last = found.length - 1;
    found = found.filter((point, index) => index === 0 || (last - index) % 2 === 0 || point === best);
  }
  return found;
}

export const completionOf = (evaluation: Point): number => {
  const shares = evaluation["completions"] as number[];
  return shares.reduce((sum, share) => sum + share, 0) / Math.max(shares.length, 1);
};

export const bestLapOf = (evaluation: Point): number | null => {
  const laps = evaluation["lap_times"] as number[];
  return laps.length ? Math.min(...laps) : null;
};

/** The fastest lap of some evaluations and of what was known before. */
export const fastestOf = (evaluations: Point[], before: number | null): number | null =>
  evaluations
    .map(bestLapOf)
    .reduce((best, lap) => (lap !== null && (best === null || lap < best) ? lap : best), before);

/** Mean of a value and its neighbours, so that a noisy curve shows its way; null where nothing is known. */
export function smooth(values: (number | null)[], reach: number): (number | null)[] {
  if (reach <= 0) return values;
  return values.map((_, index) => {
    const known = values.slice(Math.max(0, index - reach), index + reach + 1).filter((v): v is number => v !== null);
    return known.length ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
  });
}

export type HintKey = "entropy" | "value" | "exploit" | "stuck" | "kl" | "forgot";

export interface Hint {
  key: HintKey;
  /** The numbers that say it, for the sentence of evidence. */
  values: Record<string, string>;
}

const FEW = 20; // iterations before which nothing is said
const MUCH = 20_000; // steps in which a usual training gets round

/** What the curves say when something goes wrong, with the numbers that say it. */
export function hints(curves: Curves, numActions: number): Hint[] {
  const found: Hint[] = [];
  const points = curves.iterations;
  const last = points[points.length - 1];
  if (!last || points.length < FEW) return found;
  const number = (point: Point, name: string) => (typeof point[name] === "number" ? (point[name] as number) : null);
  const entropy = number(last, "entropy");
  const completion = number(last, "completion") ?? 0;
  const most = Math.log(Math.max(numActions, 1));
  if (entropy !== null && numActions > 1 && entropy < 0.05 * most && completion < 0.5)
    found.push({
      key: "entropy",
      values: { now: fixed(entropy, 3), most: fixed(most, 2), completion: percent(completion) },
    });

  const losses = points.slice(-40).map((point) => number(point, "value_loss") ?? 0);
  const before = Math.max(...losses.slice(0, 20), 1e-9);
  const after = losses[losses.length - 1]!;
  if (losses.length === 40 && after > 50 * before)
    found.push({ key: "value", values: { before: short(before, 2), after: short(after, 2) } });

  const steps = points
    .slice(-FEW)
    .map((point) => Math.abs(number(point, "approx_kl") ?? 0))
    .sort((a, b) => a - b);
  const usual = steps[steps.length >> 1]!;
  if (usual > 0.15) found.push({ key: "kl", values: { now: fixed(usual, 2) } });

  if (last.step >= MUCH) {
    // what was usual in the first half of the way, after its beginning, against what is usual now
    const mean = (from: number, to: number, name: string) => {
      const known = points
        .slice(Math.floor(from * points.length), Math.ceil(to * points.length))
        .map((point) => number(point, name))
        .filter((value) => value !== null);
      return known.length ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
    };
    const [r0, r1] = [mean(0.1, 0.4, "reward"), mean(0.8, 1, "reward")];
    const [c0, c1] = [mean(0.1, 0.4, "completion"), mean(0.8, 1, "completion")];
    if (r0 !== null && r1 !== null && c0 !== null && c1 !== null) {
      if (r1 > r0 + 0.5 * Math.abs(r0) && c1 < c0 + 0.02 && c1 < 0.5)
        found.push({
          key: "exploit",
          values: { r0: fixed(r0, 1), r1: fixed(r1, 1), c0: percent(c0), c1: percent(c1) },
        });
      else if (last.step > 2 * MUCH && c1 < 0.15)
        found.push({ key: "stuck", values: { completion: percent(c1), steps: count(last.step) } });
    }
  }

  const best = curves.best;
  const recent = curves.evaluations.slice(-3).map(completionOf);
  if (best && recent.length === 3 && completionOf(best) >= 0.9 && Math.max(...recent) < completionOf(best) - 0.3)
    found.push({
      key: "forgot",
      values: { best: percent(completionOf(best)), step: count(best.step), now: percent(Math.max(...recent)) },
    });
  return found;
}

export interface LogEntry {
  kind: "best" | "evaluation" | "note";
  step: number;
  seconds: number;
  point: Point;
}

/** What happened, newest first. */
export function logOf(curves: Curves): LogEntry[] {
  const entries: LogEntry[] = [
    ...curves.evaluations.map((point): LogEntry => ({
      kind: point["is_best"] ? "best" : "evaluation",
      step: point.step,
      seconds: point.seconds,
      point,
    })),
    ...curves.notes.map((point): LogEntry => ({ kind: "note", step: point.step, seconds: point.seconds, point })),
  ];
  return entries.sort((a, b) => b.seconds - a.seconds);
}
