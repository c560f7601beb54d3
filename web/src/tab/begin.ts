/** The model that a training begins from, and what of its network goes over: racecraft.training.parent. */
import type { Policy } from "./plan";

const HEADS = ["policy.head.weight", "policy.head.bias", "policy.log_std"]; // depend on the action space alone

/** Somebody's weights: those that drove its evaluation, and what they are. */
export interface Beginning {
  weights: Float32Array;
  layout: Policy["weights"]; // name and shape of every array
}

const sizeOf = (shape: number[]) => shape.reduce((size, side) => size * side, 1);

/** Whether a network of this layout can begin from another: only the policy's head and the critic may differ. */
export function fits(layout: Policy["weights"], from: Policy["weights"]): boolean {
  const given = new Map(from.map(([name, shape]) => [name, shape.join()]));
  return layout.every(
    ([name, shape]) => HEADS.includes(name) || name.startsWith("critic.") || given.get(name) === shape.join(),
  );
}

/** The first weights: `fresh` ones where something differs. A critic or a head goes over as a whole or not at all. */
export function firstWeights(layout: Policy["weights"], fresh: Float32Array, from: Beginning): Float32Array {
  const given = new Map<string, { shape: string; values: Float32Array }>();
  let at = 0;
  for (const [name, shape] of from.layout)
    given.set(name, { shape: shape.join(), values: from.weights.subarray(at, (at += sizeOf(shape))) });
  const isSame = ([name, shape]: [string, number[]]) => given.get(name)?.shape === shape.join();
  const isWhole = (isPart: (name: string) => boolean) => layout.filter(([name]) => isPart(name)).every(isSame);
  const isCritic = (name: string) => name.startsWith("critic.");
  const isHead = (name: string) => HEADS.includes(name);
  const [hasCritic, hasHead] = [isWhole(isCritic), isWhole(isHead)];
  const first = fresh.slice();
  at = 0;
  for (const [name, shape] of layout) {
    const goesOver = isCritic(name) ? hasCritic : isHead(name) ? hasHead : isSame([name, shape]);
    if (goesOver) first.set(given.get(name)!.values, at);
    at += sizeOf(shape);
  }
  return first;
}
