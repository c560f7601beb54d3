/** A model's own request, as what somebody typed for a new one: a copy whose every setting can be changed. */
import type { ActionPreset, Choices, RewardPreset } from "../api/client";
import { saidBy } from "./awsfiles";
import { wholeCar } from "./conditions";
import { presetOf, usualObjects, type Numbers } from "./newmodel";
import { roadOf } from "./raceterms";
import type { Typed } from "./newdraft";
import type { components } from "../api/schema";

type Request = components["schemas"]["NewModel"];

export interface Offered {
  rewards: RewardPreset[];
  spaces: ActionPreset[];
  choices: Choices;
}

export function typedOf(request: Request, { rewards, spaces, choices }: Offered): Typed {
  const said = saidBy("model_metadata.json", JSON.stringify(request.model_metadata));
  const space = presetOf(said.space, spaces) ?? said.space;
  const isAws = request.hyperparameters != null;
  const defaults = (isAws ? choices.aws : choices.fast) as Numbers;
  const given = (isAws ? request.hyperparameters : request.tuning) ?? {};
  const tuned = Object.entries(given).filter(
    (entry): entry is [string, number | string] =>
      entry[0] in defaults && entry[1] !== null && defaults[entry[0]] !== entry[1],
  );
  const race = request.race;
  return {
    name: "",
    track: request.track,
    moreTracks: request.more_tracks ?? [],
    direction: request.direction,
    space,
    sensors: said.sensors ?? [],
    source: rewards.find((reward) => reward.name === request.reward)?.source ?? request.reward,
    until: request.until,
    seed: request.seed,
    vehicle:
      request.vehicle === "v5"
        ? ""
        : typeof request.vehicle === "string"
          ? request.vehicle
          : wholeCar(request.vehicle, choices),
    network: request.network === "RACECRAFT_SMALL" ? "" : request.network,
    algorithm: request.algorithm,
    critic: request.critic,
    randomize: request.randomize,
    race,
    opponents: request.opponents ?? [],
    cars: request.cars ?? 2,
    objects: request.objects ?? usualObjects(race),
    road: roadOf(request),
    learning: isAws ? "learning_aws" : "learning_fast",
    tuned: Object.fromEntries(tuned),
  };
}
