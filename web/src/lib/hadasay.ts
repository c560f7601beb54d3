/** The settings of a training that had a say in it, as they are held against another's. */
import { plain, withUnit } from "./numbers";

type Document = Record<string, unknown>;

const ALGORITHMS = ["ppo", "sac", "distill", "sb3"];
const TEACHES: Record<string, string[]> = { distill: ["ppo", "distill"] }; // whose teacher learns by PPO

/** Without the numbers of algorithms that it does not learn by, and with its actions as a text. */
export function hadASay(settings: Document): Document {
  const algorithm = String(settings["algorithm"] ?? "ppo");
  const used = TEACHES[algorithm] ?? [algorithm.replace(/:.*/, "")];
  const found = Object.fromEntries(
    Object.entries(settings).filter(([name]) => !ALGORITHMS.includes(name) || used.includes(name)),
  );
  const metadata = found["model_metadata"] as Document | undefined;
  if (metadata?.["action_space"])
    found["model_metadata"] = { ...metadata, action_space: actionsText(metadata["action_space"]) };
  return found;
}

/** "−30°: 1; 2 m/s", a line for each angle; or from where to where. */
function actionsText(space: unknown): string {
  if (!Array.isArray(space)) {
    const { steering_angle: angle, speed } = space as Record<string, { low: number; high: number }>;
    return angle && speed
      ? `${plain(angle.low)}° … ${plain(angle.high)}°\n${plain(speed.low)} … ${withUnit(speed.high, "m/s")}`
      : JSON.stringify(space);
  }
  const speeds = new Map<number, number[]>();
  for (const { steering_angle, speed } of space as { steering_angle: number; speed: number }[])
    speeds.set(steering_angle, [...(speeds.get(steering_angle) ?? []), speed]);
  const told = (all: number[]) => [...all.slice(0, -1).map(plain), withUnit(all.at(-1), "m/s")].join("; ");
  return [...speeds].map(([angle, all]) => `${plain(angle)}°: ${told(all)}`).join("\n");
}
