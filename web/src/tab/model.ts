/** A car that learned in this tab, and the archive of it that `racecraft import` takes. */
import type { ActionPreset } from "../api/client";
import type { Trace } from "./drivencar";
import { weightsAlone, wholeTraining } from "./checkpoint";
import type { Plan, Policy, RaceType, TrackFile } from "./plan";
import { policyFor } from "./policy";
import { gzip, tar } from "./tar";
import type { Judgement, TrainingState } from "./trainer";
import type { Objects } from "./verify/header";

export interface Model {
  name: string;
  created: string; // ISO 8601
  track: string;
  trackDigest: string;
  seed: number;
  reward: string; // Python
  steps: number;
  seconds: number;
  laps: number; // of the last evaluation
  trials?: number; // of it; none of models that were kept when there were always five
  bestLap: number | null; // s
  space?: ActionPreset; // none of models that were kept when there was only the default one
  race?: { type: RaceType; objects: Objects }; // none of those that were kept when there were only time trials
  weights: Float32Array;
  state?: TrainingState; // of the training behind it, to go on to the same bits; none of older ones
  judgement?: Judgement;
  trace?: Trace; // of its fastest lap, to drive against; none of older ones
}

export const modelOf = (track: TrackFile, rest: Omit<Model, "track" | "trackDigest" | "created">): Model => ({
  ...rest,
  track: track.geometry.name,
  trackDigest: track.digest,
  created: new Date().toISOString(),
});

/** What it was trained as. */
export function policyOf({ race, space }: Model, plan: Plan): Policy {
  const { type, objects } = race ?? { type: "time-trial", objects: { obstacles: null, bots: null } };
  return policyFor(plan.races[type], space ?? plan.spaces[0]!, objects);
}

const text = (value: unknown) => new TextEncoder().encode(typeof value === "string" ? value : JSON.stringify(value));

/** A run folder that the installed program goes on with: where the training was kept whole, with the step that would
 * have come next, otherwise from its weights. */
export async function archive(model: Model, plan: Plan): Promise<Blob> {
  const { created, seed, track, trackDigest: track_digest, weights, steps, seconds, state, judgement } = model;
  const policy = policyOf(model, plan);
  const time_stamp = Date.parse(created) / 1000;
  const checkpoint =
    state && judgement
      ? wholeTraining(plan, policy, weights, { state, judgement, seconds, created: time_stamp })
      : weightsAlone(policy, weights, { steps, seconds: time_stamp });
  const { step, score, metrics } = checkpoint;
  const digest = await sha256(checkpoint.file);
  const file = `${String(step).padStart(9, "0")}-${digest.slice(0, 8)}.safetensors`;
  const entry = { step, file, size: checkpoint.file.length, sha256: digest, time_stamp, score, metrics };
  const manifest = { format: 1, best: file, last: file, checkpoints: [entry] };
  const files = {
    "run.json": text({ ...policy.run, seed, track, track_digest, created }),
    "reward_function.py": text(model.reward),
    "model_metadata.json": text(policy.modelMetadata),
    "checkpoints/manifest.json": text(manifest),
    [`checkpoints/${file}`]: checkpoint.file,
  };
  const named = Object.entries(files).map(([name, data]) => [`${model.name}/${name}`, data] as const);
  return gzip(tar(Object.fromEntries(named), time_stamp));
}

/** In hexadecimal. */
export async function sha256(data: Uint8Array): Promise<string> {
  if (!globalThis.crypto?.subtle)
    throw new Error("Browsers make archives only on pages of https and of this computer.");
  const digest = await crypto.subtle.digest("SHA-256", data as Uint8Array<ArrayBuffer>);
  return [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
