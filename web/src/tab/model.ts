/** A car that learned in this tab, and the archive of it that `racecraft import` takes. */
import type { ActionPreset } from "../api/client";
import type { Trace } from "./drivencar";
import type { Plan, Policy, RaceType, TrackFile } from "./plan";
import { policyFor } from "./policy";
import { gzip, tar } from "./tar";
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
  trace?: Trace; // of its fastest lap, to drive against; none of older ones
}

export const modelOf = (track: TrackFile, rest: Omit<Model, "track" | "trackDigest" | "created">): Model => ({
  ...rest,
  track: track.geometry.name,
  trackDigest: track.digest,
  created: new Date().toISOString(),
});

const text = (value: unknown) => new TextEncoder().encode(typeof value === "string" ? value : JSON.stringify(value));

/** A run folder whose checkpoint holds weights alone: training goes on from them in the installed program. */
export async function archive(model: Model, plan: Plan): Promise<Blob> {
  const { created, seed, track, trackDigest: track_digest } = model;
  const { type, objects } = model.race ?? { type: "time-trial", objects: { obstacles: null, bots: null } };
  const policy = policyFor(plan.races[type], model.space ?? plan.spaces[0]!, objects);
  const checkpoint = checkpointOf(model, policy);
  const digest = await sha256(checkpoint);
  const file = `000000000-${digest.slice(0, 8)}.safetensors`;
  const [size, time_stamp] = [checkpoint.length, Date.parse(created) / 1000];
  const manifest = {
    format: 1,
    best: file,
    last: file,
    checkpoints: [{ step: 0, file, size, sha256: digest, time_stamp, score: null, metrics: {} }],
  };
  const files = {
    "run.json": text({ ...policy.run, seed, track, track_digest, created }),
    "reward_function.py": text(model.reward),
    "model_metadata.json": text(policy.modelMetadata),
    "checkpoints/manifest.json": text(manifest),
    [`checkpoints/${file}`]: checkpoint,
  };
  const named = Object.entries(files).map(([name, data]) => [`${model.name}/${name}`, data] as const);
  return gzip(tar(Object.fromEntries(named), Date.parse(created) / 1000));
}

/** https://huggingface.co/docs/safetensors */
function checkpointOf({ weights, created, steps }: Model, policy: Policy): Uint8Array {
  const metadata = { network: policy.spec, origin: { kind: "tab", steps } };
  const about = { step: 0, time_stamp: Date.parse(created) / 1000, score: null, metrics: {}, metadata };
  const header: Record<string, unknown> = { __metadata__: { racecraft: JSON.stringify(about) } };
  let end = 0;
  for (const [name, shape] of policy.weights) {
    const begin = end;
    end += 4 * shape.reduce((size, side) => size * side, 1);
    header[`weights/${name}`] = { dtype: "F32", shape, data_offsets: [begin, end] };
  }
  const head = text(JSON.stringify(header));
  const padded = Math.ceil(head.length / 8) * 8;
  const all = new Uint8Array(8 + padded + end).fill(0x20, 8, 8 + padded);
  new DataView(all.buffer).setBigUint64(0, BigInt(padded), true);
  all.set(head, 8);
  all.set(new Uint8Array(weights.buffer, weights.byteOffset, weights.byteLength), 8 + padded);
  return all;
}

async function sha256(data: Uint8Array): Promise<string> {
  if (!globalThis.crypto?.subtle)
    throw new Error("Browsers make archives only on pages of https and of this computer.");
  const digest = await crypto.subtle.digest("SHA-256", data as Uint8Array<ArrayBuffer>);
  return [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
