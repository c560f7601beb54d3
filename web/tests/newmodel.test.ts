import { describe, expect, it } from "vitest";
import type { ActionPreset, Choices } from "../src/api/client";
import { newModel, repaid, suited, type Known, type Wishes } from "../src/lib/newmodel";
import { newRoad } from "../src/lib/raceterms";

const space: ActionPreset = {
  name: "default",
  description: "",
  kind: "discrete",
  actions: [
    { steering_angle: -30, speed: 1 },
    { steering_angle: 30, speed: 1 },
  ],
  steering_angle: null,
  speed: null,
};
const known: Known = {
  rewards: [{ name: "racing", description: "", source: "def reward_function(params): ..." }],
  spaces: [space],
  choices: { fast: { lr: 1e-3 }, aws: { lr: 3e-4, batch_size: 64 } } as unknown as Choices,
};
const wishes: Wishes = {
  name: "",
  track: "oval",
  moreTracks: [],
  direction: "forward",
  space,
  sensors: [],
  source: known.rewards[0]!.source,
  until: "5 laps",
  seed: 7,
  vehicle: "",
  network: "",
  algorithm: "ppo",
  critic: "privileged",
  randomize: "none",
  race: "time-trial",
  opponents: [],
  cars: 2,
  objects: 6,
  road: { ...newRoad(), laneChanges: true },
  learning: "learning_fast",
  tuned: {},
};
const made = (changes: Partial<Wishes> = {}) => newModel({ ...wishes, ...changes }, known);

describe("the request for a new model", () => {
  it("names presets and leaves out what is the server's to choose", () => {
    expect(made()).toEqual({
      track: "oval",
      direction: "forward",
      until: "5 laps",
      seed: 7,
      vehicle: "",
      network: "",
      algorithm: "ppo",
      critic: "privileged",
      randomize: "none",
      race: "time-trial",
      reward: "racing",
      actions: "default",
    });
  });

  it("sends a changed reward as it is written, and a name if there is one", () => {
    expect(made({ source: "def f(): ...", name: "heron" })).toMatchObject({ reward: "def f(): ...", name: "heron" });
  });

  it("names the other tracks that it learns on, where there are any", () => {
    expect(made({ moreTracks: ["hairpin"] }).more_tracks).toEqual(["hairpin"]);
    expect(made()).not.toHaveProperty("more_tracks");
  });

  it("sends an edited space as AWS's document, with the sensors in it and not beside it", () => {
    const edited = { ...space, actions: [...space.actions, { steering_angle: 0, speed: 2 }] };
    const request = made({ space: edited, sensors: ["STEREO_CAMERAS"] });
    expect(request).not.toHaveProperty("actions");
    expect(request).not.toHaveProperty("sensors");
    expect(request.model_metadata).toMatchObject({ sensor: ["STEREO_CAMERAS"], action_space_type: "discrete" });
    expect((request.model_metadata?.["action_space"] as unknown[]).length).toBe(3);
    expect(made({ space: edited }).model_metadata).toMatchObject({ sensor: ["FRONT_FACING_CAMERA"] });
    expect(made({ sensors: ["LIDAR"] })).toMatchObject({ actions: "default", sensors: ["LIDAR"] });
  });

  it("speaks of objects only where there are some, and of bots only where they drive", () => {
    expect(made()).not.toHaveProperty("objects");
    expect(made({ race: "object-avoidance" })).toMatchObject({ objects: 6 });
    expect(made({ race: "object-avoidance" })).not.toHaveProperty("bot_speed");
    const places = [{ at: 50, lane: 1 as const }];
    expect(made({ race: "object-avoidance", road: { ...newRoad("fixed"), places } }).positions).toEqual([[0.5, 1]]);
    expect(made()).not.toHaveProperty("placement");
    expect(made({ race: "head-to-bot" })).toMatchObject({ objects: 6, bot_speed: 0.2, lane_changes: true });
  });

  it("sends the numbers that differ, AWS's whole, and none where the algorithm has none", () => {
    expect(made({ tuned: { lr: 1e-3 } })).not.toHaveProperty("tuning");
    expect(made({ tuned: { lr: 2e-3, unknown: 1 } }).tuning).toEqual({ lr: 2e-3 });
    expect(made({ learning: "learning_aws", tuned: { lr: 1e-4 } }).hyperparameters).toEqual({
      lr: 1e-4,
      batch_size: 64,
    });
    const sac = made({ algorithm: "sac", learning: "learning_aws", tuned: { lr: 1e-4 } });
    expect(sac).not.toHaveProperty("hyperparameters");
    expect(sac).not.toHaveProperty("tuning");
  });
});

describe("another race", () => {
  const duel = { name: "duel", description: "", source: "def reward_function(params): # duel" };
  const continuous: ActionPreset = { ...space, name: "continuous", kind: "continuous", actions: [] };
  const all = { rewards: [...known.rewards, duel], spaces: [space, continuous] };

  it("brings what suits it, and takes it back", () => {
    const raced = suited({ from: "time-trial", to: "head-to-head" }, wishes, all);
    expect(raced).toEqual({
      source: duel.source,
      space: continuous,
      sensors: ["FRONT_FACING_CAMERA", "LIDAR"],
      until: "10 minutes",
      critic: "lap",
      algorithm: "distill",
    });
    const { source, sensors, until, critic, algorithm } = wishes;
    const alone = suited({ from: "head-to-head", to: "time-trial" }, { ...wishes, ...raced }, all);
    expect(alone).toEqual({ source, space, sensors, until, critic, algorithm });
  });

  it("brings what learns among objects, from any race", () => {
    const dodge = { name: "dodge", description: "", source: "def reward_function(params): return 1" };
    const among = suited({ from: "time-trial", to: "object-avoidance" }, wishes, {
      rewards: [...known.rewards, dodge],
      spaces: [space, { ...space, name: "steady", actions: [{ steering_angle: 0, speed: 1 }] }],
    });
    expect([among.source, among.space.name, among.until]).toEqual([dodge.source, "steady", "20 laps or 10 minutes"]);
    expect([among.algorithm, among.sensors]).toEqual(["distill", ["FRONT_FACING_CAMERA", "LIDAR"]]);
    expect(suited({ from: "object-avoidance", to: "head-to-bot" }, { ...wishes, ...among }, all)).toEqual(among);
    const sac = { ...wishes, ...among, algorithm: "sac" };
    expect(suited({ from: "head-to-bot", to: "time-trial" }, sac, all).algorithm).toBe("sac");
  });

  it("pays dearer mistakes among objects to who drives faster than a walk", () => {
    const [dodge, slalom] = ["dodge", "slalom"].map((name) => ({ name, description: "", source: `# ${name}` }));
    const steady: ActionPreset = { ...space, name: "steady", actions: [{ steering_angle: 0, speed: 1 }] };
    const fast: ActionPreset = { ...space, name: "fast", actions: [{ steering_angle: 0, speed: 4 }] };
    const offered = { rewards: [...known.rewards, dodge!, slalom!], spaces: [space, steady, continuous, fast] };
    const [walking, racing] = [steady, fast].map((one) => ({ race: "object-avoidance", space: one }));
    expect(repaid("# dodge", walking!, racing!, offered.rewards)).toBe("# slalom");
    expect(repaid("# slalom", racing!, walking!, offered.rewards)).toBe("# dodge");
    expect(repaid("# mine", walking!, racing!, offered.rewards)).toBe("# mine");
    const any = { race: "head-to-bot", space: { ...continuous, speed: [0.5, 4] as [number, number] } };
    expect(repaid("# dodge", walking!, any, offered.rewards)).toBe("# slalom");
    const chosen = { ...wishes, space: fast };
    const among = suited({ from: "time-trial", to: "head-to-bot" }, chosen, offered);
    expect([among.source, among.space.name]).toEqual(["# slalom", "fast"]);
    expect(suited({ from: "head-to-bot", to: "time-trial" }, { ...chosen, ...among }, offered).source).toBe(
      wishes.source,
    );
  });

  it("leaves alone what somebody chose", () => {
    const chosen = { ...wishes, source: "mine", until: "3 laps", sensors: ["LEFT_CAMERA"] };
    const raced = suited({ from: "time-trial", to: "head-to-head" }, chosen, all);
    expect([raced.source, raced.until, raced.sensors]).toEqual(["mine", "3 laps", ["LEFT_CAMERA"]]);
    const boxes = { from: "time-trial", to: "object-avoidance" };
    expect(suited(boxes, { ...wishes, tuned: { lr: 1e-4 } }, all).algorithm).toBe("ppo");
    expect(suited(boxes, { ...wishes, learning: "learning_aws" }, all).algorithm).toBe("ppo");
    expect(suited(boxes, wishes, all).algorithm).toBe("distill");
  });

  it("says who drives the other cars, and no boxes", () => {
    const request = made({ race: "head-to-head", opponents: ["ada"], cars: 3 });
    expect([request.opponents, request.cars, request.objects]).toEqual([["ada"], 3, undefined]);
    expect(made().cars).toBeUndefined();
  });
});
