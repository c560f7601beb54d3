/** How a model drives that came from elsewhere, found out in a worker of its own: a training goes on beside it. */
import type { Arrival } from "./arrive";
import { modelOf, policyOf, type Model } from "./model";
import { openWorker } from "./open";
import type { Plan, TrackFile } from "./plan";
import type { Evaluation } from "./trainer";
import type { Judge, Load, Report } from "./worker";

export async function judged(site: string, plan: Plan, arrival: Arrival, track: TrackFile): Promise<Model> {
  const model = modelOf(track, { ...arrival, laps: 0, bestLap: null });
  const { type, objects } = arrival.race!;
  const policy = policyOf(model, plan);
  const begin = { weights: arrival.weights, layout: policy.weights };
  const asked = {
    kind: "judge",
    plan,
    race: plan.races[type],
    policy,
    objects,
    track,
    seed: arrival.seed,
    begin,
  } as const;
  const { completions, lapTimes, trace } = await evaluation(site, asked);
  const bestLap = lapTimes.length ? Math.min(...lapTimes) : null;
  return { ...model, laps: lapTimes.length, trials: completions.length, bestLap, trace };
}

function evaluation(site: string, asked: Judge): Promise<Evaluation> {
  const worker = openWorker();
  return new Promise<Evaluation>((done, failed) => {
    worker.onerror = ({ message }) => failed(new Error(message || "worker"));
    worker.onmessage = ({ data }: MessageEvent<Report>) => {
      if (data.kind === "judged") done(data.evaluation);
      else if (data.kind === "failed") failed(new Error(data.message));
    };
    worker.postMessage({ kind: "load", site, hasPython: false, isTeam: false } satisfies Load);
    worker.postMessage(asked);
  }).finally(() => worker.terminate());
}
