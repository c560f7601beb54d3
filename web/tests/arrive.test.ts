import { expect, test } from "vitest";
import { ArrivalProblem } from "../src/tab/arrivalproblem";
import { arrivalOf } from "../src/tab/arrive";
import { archive, type Model } from "../src/tab/model";
import type { Plan } from "../src/tab/plan";
import { tensorFile } from "../src/tab/safetensors";
import { gzip, tar } from "../src/tab/tar";
import { untar } from "../src/tab/untar";

const NOTHING = { obstacles: null, bots: null };
const SETTINGS = { network: "TINY", camera: "2018", direction: "forward", vehicle: { mass: 7.5 }, opponents: null };
const WEIGHTS: [string, number[]][] = [
  ["policy.dense1.weight", [4, 3]],
  ["policy.head.weight", [2, 4]],
  ["policy.head.bias", [2]],
];
const policy = {
  network: { numbers: {} },
  layers: [
    [4, 3, 1],
    [2, 4, 1],
  ],
  weights: WEIGHTS,
  spec: {},
  run: { format: 1, settings: SETTINGS },
  modelMetadata: { sensor: ["FRONT_FACING_CAMERA"] },
};
const race = { policies: { default: policy, continuous: policy }, objects: NOTHING };
const plan = {
  races: { "time-trial": race, "object-avoidance": race, "head-to-bot": race },
  tracks: ["oval"],
  spaces: [],
} as unknown as Plan;
const space = {
  ...{ name: "", description: "", kind: "discrete" as const },
  actions: [-20, 0, 20].map((steering_angle) => ({ steering_angle, speed: 1.5 })),
};
const model: Model = {
  ...{ name: "mine", created: "2026-01-01T00:00:00.000Z", track: "oval", trackDigest: "abc", seed: 5, steps: 123 },
  ...{ reward: "def reward_function(params):\n    return 1.0\n", seconds: 1, laps: 5, bestLap: 9, space },
  ...{ race: { type: "time-trial", objects: NOTHING }, weights: Float32Array.from({ length: 27 }, (_, i) => i / 7) },
};
const digestOf = (track: string) => Promise.resolve(track === "oval" ? "abc" : undefined);
const arrives = (file: Blob) => arrivalOf(file, plan, digestOf);
const all = async () => untar(await archive(model, plan), () => 1 << 20);
const packed = async (files: Map<string, Uint8Array>) => gzip(tar(Object.fromEntries(files), 0));
const bytes = (value: unknown) => new TextEncoder().encode(typeof value === "string" ? value : JSON.stringify(value));

/** A download of which something was changed. */
async function changed(name: string, change: (document: Record<string, unknown>) => unknown): Promise<Blob> {
  const files = await all();
  const path = [...files.keys()].find((one) => one.endsWith(name))!;
  const document = JSON.parse(new TextDecoder().decode(files.get(path))) as Record<string, unknown>;
  return packed(new Map(files).set(path, bytes(change(document) ?? document) as Uint8Array<ArrayBuffer>));
}

const problem = (file: Blob) =>
  arrives(file).then(
    () => "none",
    (error: unknown) => (error instanceof ArrivalProblem ? error.key : String(error)),
  );

test("a download comes back as what it was", async () => {
  const { name, track, seed, reward, race, weights, space: found } = await arrives(await archive(model, plan));
  expect({ name, track, seed, reward, race, actions: found?.actions }).toEqual({
    ...{ name: "mine", track: "oval", seed: 5, reward: model.reward, race: model.race },
    actions: space.actions,
  });
  expect(weights).toEqual(model.weights);
});

test("actions arrive with all their digits, and as wide as files of their version may be", async () => {
  const told = (version: unknown, angles: number[]) =>
    changed("model_metadata.json", (metadata) => ({
      ...{ ...metadata, version }, // none is not written
      action_space: angles.map((steering_angle) => ({ steering_angle, speed: 4 / 3 })),
    }));
  for (const version of ["1", "2", 2, undefined]) {
    const { space: found } = await arrives(await told(version, [-45, 0, 45]));
    expect(found?.actions.map((one) => [one.steering_angle, one.speed])).toEqual([-45, 0, 45].map((a) => [a, 4 / 3]));
    expect(
      new TextDecoder().decode(
        (await untar(await archive({ ...model, space: found }, plan), () => 1 << 20)).get("mine/model_metadata.json"),
      ),
    ).toContain('"version":"2"');
  }
  expect(await problem(await told("5", [-45, 0, 45]))).toBe("arrive_damaged");
  expect(await problem(await told("2", [-46, 0, 45]))).toBe("arrive_damaged");
});

test("what this page does not have is refused with its name", async () => {
  const settings = (more: object) =>
    changed("run.json", (run) => ({ ...run, settings: { ...(run["settings"] as object), ...more } }));
  expect(await problem(await settings({ direction: "reverse" }))).toBe("arrive_other");
  expect(await problem(await settings({ vehicle: { mass: 8 } }))).toBe("arrive_other");
  expect(await problem(await changed("run.json", (run) => ({ ...run, track: "elsewhere" })))).toBe("arrive_track");
  expect(await problem(await changed("run.json", (run) => ({ ...run, track_digest: "abd" })))).toBe("arrive_track");
  const lidar = await changed("model_metadata.json", (told) => ({ ...told, sensor: ["LIDAR"] }));
  expect(await problem(lidar)).toBe("arrive_sensors");
});

test("what is no archive, damaged or hostile gets a sentence", async () => {
  const whole = new Uint8Array(await (await archive(model, plan)).arrayBuffer());
  expect(await problem(new Blob([bytes("nothing of the kind")]))).toBe("arrive_damaged");
  expect(await problem(await gzip(bytes("x".repeat(600))))).toBe("arrive_not");
  expect(await problem(await packed(new Map([["a/b.txt", bytes("hello")]])))).toBe("arrive_not");
  expect(await problem(new Blob([whole.subarray(0, whole.length / 2)]))).toBe("arrive_damaged");
  const two = new Map(await all()).set("other/run.json", bytes({}) as Uint8Array<ArrayBuffer>);
  expect(await problem(await packed(two))).toBe("arrive_not");
  const seeds = ["1", -1, 1.5, null, 2 ** 60];
  for (const seed of seeds)
    expect(await problem(await changed("run.json", (run) => ({ ...run, seed })))).toBe("arrive_damaged");
  const spaces = [
    [],
    [null, null],
    Array(31).fill(space.actions[0]),
    [space.actions[0], { steering_angle: 1e9, speed: 1 }],
  ];
  for (const action_space of spaces)
    expect(await problem(await changed("model_metadata.json", (told) => ({ ...told, action_space })))).toBe(
      "arrive_damaged",
    );
  const objects = { obstacles: { count: 1e9 }, bots: null };
  const crowd = await changed("run.json", (run) => ({ ...run, settings: { ...SETTINGS, objects } }));
  expect(await problem(crowd)).toBe("arrive_damaged");
});

test("weights are believed when their checksum, shape and every number are right", async () => {
  const swap = async (weights: Float32Array, shapes = [[4, 3], [3, 4], [3]]) => {
    const files = new Map(await all());
    const path = [...files.keys()].find((name) => name.endsWith(".safetensors"))!;
    const names = WEIGHTS.map(([name]) => `weights/${name}`);
    let at = 0;
    const tensors = names.map((name, index) => {
      const size = shapes[index]!.reduce((a, b) => a * b, 1);
      return [name, { data: weights.subarray(at, (at += size)), shape: shapes[index]! }] as const;
    });
    const file = tensorFile(Object.fromEntries(tensors), {});
    files.set(path, file);
    const sum = new Uint8Array(await crypto.subtle.digest("SHA-256", file));
    const sha256 = [...sum].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    const manifest = [...files.keys()].find((name) => name.endsWith("manifest.json"))!;
    const told = JSON.parse(new TextDecoder().decode(files.get(manifest))) as { checkpoints: object[] };
    const good = { ...told, checkpoints: [{ ...told.checkpoints[0], sha256 }] };
    return {
      bad: await packed(files),
      good: await packed(files.set(manifest, bytes(good) as Uint8Array<ArrayBuffer>)),
    };
  };
  const fine = await swap(model.weights);
  expect(await problem(fine.good)).toBe("none");
  expect(await problem((await swap(model.weights.map((value) => value + 1))).bad)).toBe("arrive_damaged");
  expect(await problem((await swap(model.weights.map((v, i) => (i === 20 ? NaN : v)))).good)).toBe("arrive_other");
  expect(await problem((await swap(model.weights, [[3, 4], [3, 4], [3]])).good)).toBe("arrive_other");
});

test("an archive that unpacks without end is left, and nothing of it kept", async () => {
  const bomb = tar({ "a/run.json": new Uint8Array(4 << 20) }, 0);
  expect(await problem(await gzip(bomb))).toBe("arrive_not"); // passed over: a run.json is small
});
