/** A model's action space as the pictures take it. */
import type { ActionPreset, ModelDetail } from "../api/client";

export function spaceOf(model: ModelDetail): ActionPreset {
  const actions = model.model_metadata["action_space"];
  if (Array.isArray(actions))
    return {
      name: "",
      description: "",
      kind: "discrete",
      actions: actions.map((action) => ({
        steering_angle: Number(action.steering_angle),
        speed: Number(action.speed),
      })),
    };
  const limits = actions as Record<string, { low: number; high: number }>;
  const pair = (key: string) => [Number(limits[key]?.low ?? 0), Number(limits[key]?.high ?? 0)];
  return {
    name: "",
    description: "",
    kind: "continuous",
    actions: [],
    steering_angle: pair("steering_angle"),
    speed: pair("speed"),
  };
}
