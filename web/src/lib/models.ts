/** What a model's card tells beyond its numbers. */
import type { components } from "../api/schema";

type Card = components["schemas"]["ModelCard"];
type Detail = components["schemas"]["ModelDetail"];

/** Whether it has a policy: one that was learned here, or elsewhere, in no steps of ours. */
export const canDrive = (model: Pick<Card, "steps" | "status">) => model.steps > 0 || model.status === "finished";

/** Whether each word that is looked for stands in its name, its tags, or what its track is called. */
export function isFound(
  model: Pick<Card, "name" | "track" | "tags">,
  query: string,
  titleOf: (track: string) => string,
): boolean {
  const text = [model.name, model.track, titleOf(model.track), ...model.tags].join(" ").toLowerCase();
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  return words.every((word) => text.includes(word));
}

/** What the map of a model's attention was made on: of a policy that is told by perception it is perception's network. */
export const lookedAt = (model: Pick<Detail, "settings">) =>
  model.settings["network"] === "PERCEPTION" ? "saliency_how_told" : "saliency_how";
