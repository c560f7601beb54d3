/** What a model's card tells beyond its numbers. */
import type { components } from "../api/schema";

type Card = Pick<components["schemas"]["ModelCard"], "steps" | "status">;

/** Whether it has a policy: one that was learned here, or elsewhere, in no steps of ours. */
export const canDrive = (model: Card) => model.steps > 0 || model.status === "finished";
