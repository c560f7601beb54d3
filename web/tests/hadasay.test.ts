import { describe, expect, it } from "vitest";
import { differences } from "../src/lib/diff";
import { hadASay } from "../src/lib/hadasay";

const numbers = { ppo: { lr: 1 }, sac: { tau: 1 }, distill: { teacher_steps: 1 }, sb3: {} };

describe("settings that had a say", () => {
  it("leaves out the numbers of what it does not learn by", () => {
    expect(Object.keys(hadASay({ algorithm: "ppo", ...numbers }))).toEqual(["algorithm", "ppo"]);
    expect(Object.keys(hadASay({ algorithm: "sac", ...numbers }))).toEqual(["algorithm", "sac"]);
    expect(Object.keys(hadASay({ algorithm: "distill", ...numbers }))).toEqual(["algorithm", "ppo", "distill"]);
    expect(Object.keys(hadASay({ algorithm: "sb3:td3", ...numbers }))).toEqual(["algorithm", "sb3"]);
  });

  it("tells actions as people read them", () => {
    const action = (steering_angle: number, speed: number, index: number) => ({ steering_angle, speed, index });
    const few = [action(-30, 1, 0), action(-30, 2, 1), action(0, 2, 2)];
    const any = { steering_angle: { low: -30, high: 30 }, speed: { low: 0.5, high: 4 } };
    const [space] = differences([few, any].map((action_space) => hadASay({ model_metadata: { action_space } })));
    expect(space).toEqual({
      name: "model_metadata.action_space",
      values: ["−30°: 1; 2\u00a0m/s\n0°: 2\u00a0m/s", "−30° … 30°\n0.5 … 4\u00a0m/s"],
    });
  });
});
