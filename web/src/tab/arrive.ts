/** A model that comes as an archive, of this page, the console or `racecraft`: racecraft.run.archive says what is in it.
 *
 * It may be anybody's, so nothing of it is believed: what is taken over is checked field by field, and what else it says
 * is left. How it drives is not read but judged anew. */
import type { ActionPreset } from "../api/client";
import { MAX_ACTIONS, MAX_FILE_STEERING, MAX_SPEED, MAX_STEERING, MIN_ACTIONS } from "../lib/actions";
import { ArrivalProblem } from "./arrivalproblem";
import { sha256, type Model } from "./model";
import type { Plan, RaceType } from "./plan";
import { policyFor } from "./policy";
import { TensorReader } from "./safetensors";
import { untar } from "./untar";
import { around } from "./verify/header";

const MOST_TEXT = 1 << 20; // bytes of each file but checkpoints
const MOST_SOURCE = 140_000; // characters, the most that AWS accepts
const MOST_CHECKPOINT = 16 << 20; // bytes; this page's networks take two
const MOST_NAME = 40; // characters
const WANTED = /^[^/]{1,200}\/(?:run\.json|model_metadata\.json|reward_function\.py|checkpoints\/manifest\.json)$/;
const CHECKPOINT = /^[^/]{1,200}\/checkpoints\/\d{9,18}-[0-9a-f]{8}\.safetensors$/;
const SAME = ["network", "camera", "direction", "vehicle", "opponents"]; // settings that this page has one of

type Table = Record<string, unknown>;
export type Arrival = Omit<Model, "created" | "trackDigest" | "laps" | "trials" | "bestLap" | "trace">;

const damaged = (): never => {
  throw new ArrivalProblem("arrive_damaged");
};

/** What a file brings, to be judged; an ArrivalProblem where this page cannot have it. `digestOf`: of a track that is there, of the library or drawn. */
export async function arrivalOf(
  file: Blob,
  plan: Plan,
  digestOf: (track: string) => Promise<string | undefined>,
): Promise<Arrival> {
  const files = await untar(file, (name) =>
    WANTED.test(name) ? MOST_TEXT : CHECKPOINT.test(name) ? MOST_CHECKPOINT : 0,
  );
  const roots = new Set([...files.keys()].map((name) => name.split("/")[0]!));
  const [root] = roots;
  if (!root || roots.size > 1) throw new ArrivalProblem("arrive_not");
  const bytes = (name: string) => files.get(`${root}/${name}`);
  const table = (name: string) => tableOf(text(bytes(name)));
  if (!bytes("run.json")) throw new ArrivalProblem("arrive_not");

  const run = table("run.json");
  const settings = run["settings"] as Table;
  const metadata = table("model_metadata.json");
  if (typeof settings !== "object" || settings === null) return damaged();
  const objects = objectsOf(settings["objects"]);
  const type: RaceType = objects.bots ? "head-to-bot" : objects.obstacles ? "object-avoidance" : "time-trial";
  const race = plan.races[type];
  const space = spaceOf(metadata);
  const policy = policyFor(race, space, objects);
  if (sensorsOf(metadata) !== sensorsOf(policy.modelMetadata) || (objects.bots && objects.obstacles))
    throw new ArrivalProblem("arrive_sensors");
  const planned = policy.run["settings"] as Table;
  for (const name of SAME)
    if (told(settings[name]) !== told(planned[name])) throw new ArrivalProblem("arrive_other", { what: name });

  const { track, track_digest, seed } = run;
  if (typeof track !== "string" || !Number.isSafeInteger(seed) || (seed as number) < 0) return damaged();
  if ((await digestOf(track)) !== track_digest) throw new ArrivalProblem("arrive_track", { track: track.slice(0, 60) });
  const reward = text(bytes("reward_function.py"));
  if (reward.length > MOST_SOURCE) damaged();
  const { step, file: name, sum } = bestOf(table("checkpoints/manifest.json"));
  const checkpoint = bytes(`checkpoints/${name}`);
  if (!checkpoint) throw new ArrivalProblem("arrive_other", { what: "network" });
  if ((await sha256(checkpoint)) !== sum) damaged();
  const weights = weightsOf(checkpoint, policy.weights);
  return {
    name: nameOf(root),
    track,
    seed: seed as number,
    reward,
    steps: step,
    seconds: 0,
    space,
    race: { type, objects },
    weights,
  };
}

/** What `keep` and pages may call it. */
const nameOf = (root: string) =>
  root
    .replaceAll(/[^A-Za-z0-9_-]+/g, "-")
    .slice(0, MOST_NAME)
    .replace(/^-+|-+$/g, "") || "model";

function text(bytes: Uint8Array | undefined): string {
  if (!bytes) return damaged();
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return damaged();
  }
}

function tableOf(source: string): Table {
  let found: unknown;
  try {
    found = JSON.parse(source);
  } catch {
    return damaged();
  }
  return typeof found === "object" && found !== null && !Array.isArray(found) ? (found as Table) : damaged();
}

/** A setting as a text that does not depend on the order of names, nor on whether a whole number was written with a point. */
const told = (value: unknown): string =>
  typeof value === "object" && value !== null && !Array.isArray(value)
    ? `{${Object.entries(value)
        .sort(([a], [b]) => (a < b ? -1 : 1))
        .map(([name, one]) => `${name}:${told(one)}`)
        .join()}}`
    : JSON.stringify(value ?? null);

function sensorsOf({ sensor }: Table): string {
  return Array.isArray(sensor) ? [...(sensor as unknown[])].map(String).sort().join() : "";
}

function objectsOf(value: unknown): ReturnType<typeof around> {
  try {
    return around(value ?? { obstacles: null, bots: null }, "objects");
  } catch {
    return damaged();
  }
}

const ROUNDED = 1e-6; // degrees or m/s: what a number that was turned into radians and back may be beyond its limit

const within = (value: unknown, low: number, high: number): number =>
  typeof value === "number" && value >= low - ROUNDED && value <= high + ROUNDED ? value : damaged();

/** The actions of a model_metadata.json, of this page or of AWS's; an ArrivalProblem where it has none. */
export const actionsOf = (metadata: string): ActionPreset => spaceOf(tableOf(metadata));

const OLD = ["1", "2"]; // versions of the original's simulator whose files may say more than the wheels turn

function spaceOf({ action_space_type: kind, action_space: given, version }: Table): ActionPreset {
  const space = { name: "", description: "" };
  if (kind !== "continuous") {
    if (!Array.isArray(given) || given.length < MIN_ACTIONS || given.length > MAX_ACTIONS) return damaged();
    const reach = OLD.includes(String(version ?? OLD[0])) ? MAX_FILE_STEERING : MAX_STEERING;
    const actions = given.map((one: Table | null) => ({
      steering_angle: within(one?.["steering_angle"], -reach, reach),
      speed: within(one?.["speed"], 0, MAX_SPEED),
    }));
    return { ...space, kind: "discrete", actions };
  }
  const ends = (name: string, low: number, high: number) => {
    const pair = (given as Table | null)?.[name] as Table | undefined;
    const [from, to] = [within(pair?.["low"], low, high), within(pair?.["high"], low, high)];
    return from < to ? [from, to] : damaged();
  };
  const [steering_angle, speed] = [ends("steering_angle", -MAX_STEERING, MAX_STEERING), ends("speed", 0, MAX_SPEED)];
  return { ...space, kind: "continuous", actions: [], steering_angle, speed };
}

/** The checkpoint that drove best, or the last one where none was judged. */
function bestOf({ best, last, checkpoints }: Table): { step: number; file: string; sum: string } {
  const name = typeof best === "string" ? best : last;
  const entries = Array.isArray(checkpoints) ? (checkpoints as (Table | null)[]) : [];
  const found = entries.find((entry) => entry?.["file"] === name);
  const { step, file, sha256: sum } = found ?? {};
  const isStep = Number.isSafeInteger(step) && (step as number) >= 0;
  if (!isStep || typeof file !== "string" || typeof sum !== "string") return damaged();
  return { step: step as number, file, sum };
}

function weightsOf(checkpoint: Uint8Array<ArrayBuffer>, layout: [string, number[]][]): Float32Array {
  try {
    const reader = new TensorReader(checkpoint);
    const parts = layout.map(([name, shape]) => reader.floats(`weights/${name}`, shape));
    const all = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
    parts.reduce((at, part) => (all.set(part, at), at + part.length), 0);
    return all;
  } catch {
    throw new ArrivalProblem("arrive_other", { what: "network" });
  }
}
