/** The three files of a model of AWS's, given to a new model: what each says, in the words of the page. */
import type { Action, ActionPreset } from "../api/client";
import type { Key } from "../i18n/en";
import { textOf } from "./filetext";
import type { Numbers } from "./newmodel";

export interface Said {
  source?: string;
  space?: ActionPreset;
  sensors?: string[];
  network?: string;
  algorithm?: string;
  /** Hyperparameters by AWS's names. */
  numbers?: Numbers;
}

/** A file that says nothing of a model; the key of the sentence that tells it. */
export class Unreadable extends Error {
  constructor(readonly key: Key) {
    super(key);
  }
}

const MOST = 1 << 20; // characters or bytes
const CAMERA_ONLY = "FRONT_FACING_CAMERA";

type Entries = Record<string, unknown>;
const isEntries = (value: unknown): value is Entries =>
  value !== null && typeof value === "object" && !Array.isArray(value);

/** What a file says, told by what is in it rather than by its name. */
export function saidBy(name: string, data: string | ArrayBuffer): Said {
  const size = typeof data === "string" ? data.length : data.byteLength;
  if (size > MOST) throw new Unreadable("aws_file_large");
  const text = typeof data === "string" ? data : textOf(data);
  if (text === undefined) throw new Unreadable("file_no_text");
  if (/\.py$/i.test(name)) {
    if (!/\bdef\s+reward_function\b/.test(text)) throw new Unreadable("aws_file_no_reward");
    return { source: text };
  }
  let found: unknown;
  try {
    found = JSON.parse(text);
  } catch {
    throw new Unreadable("aws_file_no_json");
  }
  if (!isEntries(found)) throw new Unreadable("aws_file_unknown");
  if ("action_space" in found) return ofMetadata(found);
  if (["lr", "batch_size", "discount_factor", "num_epochs"].some((key) => key in found))
    return { numbers: numbersOf(found) };
  throw new Unreadable("aws_file_unknown");
}

function ofMetadata(found: Entries): Said {
  const said: Said = { space: spaceOf(found["action_space"]) };
  const { sensor, neural_network: network, training_algorithm: algorithm } = found;
  if (Array.isArray(sensor)) {
    const names = sensor.map((one) => (one === "observation" ? CAMERA_ONLY : String(one)));
    said.sensors = names.length === 1 && names[0] === CAMERA_ONLY ? [] : names;
  }
  if (typeof network === "string") said.network = network;
  if (typeof algorithm === "string") said.algorithm = /sac/i.test(algorithm) ? "sac" : "ppo";
  return said;
}

/** Numbers also where they are written as text, as AWS's console wrote them. */
function number(value: unknown): number {
  const found = typeof value === "number" || (typeof value === "string" && value.trim()) ? Number(value) : NaN;
  if (!Number.isFinite(found)) throw new Unreadable("aws_file_actions");
  return found;
}

function spaceOf(value: unknown): ActionPreset {
  const own = { name: "", description: "" };
  if (Array.isArray(value)) {
    const actions: Action[] = value.map((one: unknown) => {
      if (!isEntries(one)) throw new Unreadable("aws_file_actions");
      return { steering_angle: number(one["steering_angle"]), speed: number(one["speed"]) };
    });
    if (!actions.length) throw new Unreadable("aws_file_actions");
    return { ...own, kind: "discrete", actions, steering_angle: null, speed: null };
  }
  const range = (name: string): [number, number] => {
    const found = isEntries(value) ? value[name] : undefined;
    if (!isEntries(found)) throw new Unreadable("aws_file_actions");
    return [number(found["low"]), number(found["high"])];
  };
  return {
    ...own,
    kind: "continuous",
    actions: [],
    steering_angle: range("steering_angle"),
    speed: range("speed"),
  };
}

const numbersOf = (found: Entries): Numbers =>
  Object.fromEntries(
    Object.entries(found).filter(
      (entry): entry is [string, number | string] => typeof entry[1] === "number" || typeof entry[1] === "string",
    ),
  );
