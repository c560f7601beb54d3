/** What a training is told for the actions that somebody chose: the plan's policy of that kind, with their number. */
import type { ActionPreset } from "../api/client";
import { metadataOf } from "../lib/actions";
import type { Policy, RacePlan } from "./plan";
import type { Objects } from "./verify/header";

const HEAD = "policy.head"; // the layer that has a row an action
const radians = (degrees: number) => degrees * (Math.PI / 180);

export function policyFor({ policies }: RacePlan, space: ActionPreset, objects: Objects): Policy {
  const isDiscrete = space.kind === "discrete";
  const planned = isDiscrete ? policies.default : policies.continuous;
  const policy = { ...planned, run: { ...planned.run, settings: { ...(planned.run["settings"] as object), objects } } };
  const modelMetadata = { ...policy.modelMetadata, ...metadataOf(space) };
  if (!isDiscrete) {
    const [steering, speed] = [space.steering_angle!, space.speed!];
    const table = [0, 1].flatMap((end) => [radians(steering[end]!), speed[end]!]);
    return { ...policy, table, modelMetadata };
  }
  const count = space.actions.length;
  const matrices = policy.weights.filter(([name]) => name.endsWith(".weight"));
  const head = matrices.findIndex(([name]) => name === `${HEAD}.weight`);
  return {
    ...policy,
    network: { ...policy.network, numbers: { ...policy.network.numbers, num_actions: count } },
    layers: policy.layers.map((layer, index) => (index === head ? [count, ...layer.slice(1)] : layer)),
    weights: policy.weights.map(([name, shape]) => [
      name,
      name.startsWith(`${HEAD}.`) ? [count, ...shape.slice(1)] : shape,
    ]),
    table: space.actions.flatMap(({ steering_angle, speed }) => [
      Math.fround(radians(steering_angle)),
      Math.fround(speed),
    ]),
    modelMetadata,
    spec: { ...policy.spec, num_actions: count },
  };
}
