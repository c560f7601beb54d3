/** What a person chose for a new model, and the request that it becomes. */
import type { ActionPreset, Choices, NewModel, RewardPreset } from "../api/client";
import { metadataOf, sameSpace } from "./actions";
import type { AskedCar, AskedRanges } from "./conditions";
import { askedRoad, thingsOf, type Road } from "./raceterms";

export type Learning = "learning_fast" | "learning_aws";
export type Numbers = Record<string, number | string>;

export interface Wishes {
  name: string;
  track: string;
  moreTracks: string[]; // on which it learns at the same time
  direction: "forward" | "reverse" | "alternate";
  space: ActionPreset;
  sensors: string[]; // none: the front camera
  source: string;
  until: string;
  seed: number;
  vehicle: AskedCar;
  network: string;
  algorithm: string;
  critic: string;
  randomize: AskedRanges;
  race: string;
  opponents: string[]; // of a race head to head; none: itself, as it is and as it was
  cars: number;
  objects: number;
  road: Road;
  learning: Learning;
  tuned: Numbers;
}

export interface Known {
  rewards: RewardPreset[];
  spaces: ActionPreset[];
  choices: Choices | undefined;
}

/** How many things stand in a race unless somebody says another number. */
export const usualObjects = (race: string): number => (race === "head-to-bot" ? 3 : 6);

type Suited = Pick<Wishes, "source" | "space" | "sensors" | "until" | "critic" | "algorithm">;
type Usual = Omit<Suited, "source" | "space"> & { reward: string; space: string };

/** What `racecraft train --race …` does where nothing else is said, by kind of race. */
const ALONE: Usual = {
  ...{ reward: "racing", space: "default", sensors: [], until: "5 laps", critic: "privileged", algorithm: "ppo" },
};
const AMONG: Usual = {
  ...{ reward: "dodge", space: "steady", sensors: ["FRONT_FACING_CAMERA", "LIDAR"] },
  ...{ until: "20 laps or 10 minutes", critic: "privileged", algorithm: "distill" },
};
const RACED: Usual = {
  ...{ reward: "duel", space: "continuous", sensors: ["FRONT_FACING_CAMERA", "LIDAR"] },
  ...{ until: "10 minutes", critic: "lap", algorithm: "distill" },
};
const usualOf = (race: string): Usual =>
  race === "head-to-head" ? RACED : ["object-avoidance", "head-to-bot"].includes(race) ? AMONG : ALONE;

const WALK = 1; // m/s

/** What pays for a race's laps; among boxes and bots mistakes are dear for who drives faster than a walk. */
function rewardOf(race: string, space: ActionPreset | undefined): string {
  const { reward } = usualOf(race);
  const speeds = space?.speed ?? space?.actions.map((action) => action.speed) ?? [];
  return reward === AMONG.reward && Math.max(...speeds, 0) > WALK ? "slalom" : reward;
}

type Paid = { race: string; space: ActionPreset | undefined };

/** The reward for other actions, or another race: what nobody chose becomes what suits them. */
export function repaid(source: string, from: Paid, to: Paid, rewards: RewardPreset[]): string {
  const sourceOf = ({ race, space }: Paid) => rewards.find((preset) => preset.name === rewardOf(race, space))?.source;
  return source === sourceOf(from) ? (sourceOf(to) ?? source) : source;
}

/** The same wishes for another race: what nobody chose becomes what suits it. */
export function suited(
  races: { from: string; to: string },
  wishes: Suited & Pick<Wishes, "learning" | "tuned">,
  { rewards, spaces }: Pick<Known, "rewards" | "spaces">,
): Suited {
  const [from, to] = [usualOf(races.from), usualOf(races.to)];
  const isUsual = presetOf(wishes.space, spaces)?.name === from.space;
  const space = (isUsual && spaces.find((preset) => preset.name === to.space)) || wishes.space;
  const paid = { race: races.from, space: wishes.space };
  const unless = <T>(wish: T, before: T, now: T): T => (wish === before ? now : wish);
  return {
    source: repaid(wishes.source, paid, { race: races.to, space }, rewards),
    space,
    sensors: wishes.sensors.join() === from.sensors.join() ? to.sensors : wishes.sensors,
    until: unless(wishes.until, from.until, to.until),
    critic: unless(wishes.critic, from.critic, to.critic),
    algorithm: isTuned(wishes) ? wishes.algorithm : unless(wishes.algorithm, from.algorithm, to.algorithm),
  };
}

/** Whether numbers of PPO were chosen, which no other algorithm would hear of. */
const isTuned = ({ algorithm, learning, tuned }: Pick<Wishes, "algorithm" | "learning" | "tuned">): boolean =>
  algorithm === "ppo" && (learning === "learning_aws" || Object.keys(tuned).length > 0);

/** The numbers that learning begins with unless they are changed. */
export const defaultsOf = (learning: Learning, choices: Choices | undefined): Numbers | undefined =>
  (learning === "learning_aws" ? choices?.aws : choices?.fast) as Numbers | undefined;

/** The preset that a space is equal to, whatever it was made from. */
export const presetOf = (space: ActionPreset | undefined, spaces: ActionPreset[]): ActionPreset | undefined =>
  space && spaces.find((preset) => sameSpace(preset, space));

/** Presets travel by name, the rest as AWS's documents; what is not chosen is left to the server. */
export function newModel(wishes: Wishes, known: Known): NewModel {
  const { name, track, direction, until, seed, vehicle, network, algorithm, critic, randomize, race } = wishes;
  const reward = known.rewards.find((preset) => preset.source === wishes.source)?.name ?? wishes.source;
  return {
    ...(name ? { name } : {}),
    ...(wishes.moreTracks.length ? { more_tracks: wishes.moreTracks } : {}),
    ...{ track, direction, until, seed, vehicle, network, algorithm, critic, randomize, race, reward },
    ...actionsOf(wishes, known),
    ...(race === "head-to-head" ? { opponents: wishes.opponents, cars: wishes.cars } : {}),
    ...(thingsOf(race) ? { objects: wishes.objects } : {}),
    ...askedRoad(wishes.road, thingsOf(race)),
    ...numbersOf(wishes, known),
  };
}

function actionsOf({ space, sensors }: Wishes, { spaces }: Known): Partial<NewModel> {
  const preset = presetOf(space, spaces);
  if (preset) return { actions: preset.name, ...(sensors.length ? { sensors } : {}) };
  const sensor = sensors.length ? sensors : ["FRONT_FACING_CAMERA"];
  return { model_metadata: { ...metadataOf(space), sensor, neural_network: "RACECRAFT_SMALL" } };
}

function numbersOf({ algorithm, learning, tuned }: Wishes, { choices }: Known): Partial<NewModel> {
  if (algorithm !== "ppo") return {};
  const defaults = defaultsOf(learning, choices) ?? {};
  const changed = Object.fromEntries(
    Object.entries(tuned).filter(([key, value]) => key in defaults && defaults[key] !== value),
  );
  if (learning === "learning_aws") return { hyperparameters: { ...choices?.aws, ...changed } };
  return Object.keys(changed).length ? { tuning: changed } : {};
}
