import { describe, expect, it } from "vitest";
import { saidBy, Unreadable } from "../src/lib/awsfiles";

const refusal = (name: string, text: string) => {
  try {
    saidBy(name, text);
  } catch (error) {
    return (error as Unreadable).key;
  }
  return "";
};

describe("a file of AWS's", () => {
  it("is told by what is in it", () => {
    const metadata = {
      action_space: [
        { steering_angle: "-30", speed: "0.6", index: 0 },
        { steering_angle: 30, speed: 0.6, index: 1 },
      ],
      sensor: ["STEREO_CAMERAS"],
      neural_network: "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
      training_algorithm: "clipped_ppo",
      version: "4",
    };
    expect(saidBy("anything.json", JSON.stringify(metadata))).toEqual({
      space: {
        name: "",
        description: "",
        kind: "discrete",
        actions: [
          { steering_angle: -30, speed: 0.6 },
          { steering_angle: 30, speed: 0.6 },
        ],
        steering_angle: null,
        speed: null,
      },
      sensors: ["STEREO_CAMERAS"],
      network: "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
      algorithm: "ppo",
    });
    expect(saidBy("h.json", '{"lr": 0.0003, "loss_type": "huber", "nested": {}}').numbers).toEqual({
      lr: 0.0003,
      loss_type: "huber",
    });
    const source = "def reward_function(params):\n    return 1.0\n";
    expect(saidBy("my reward.py", source)).toEqual({ source });
  });

  it("may have a continuous space, and the front camera by its old name", () => {
    const range = (low: number, high: number) => ({ low, high });
    const metadata = {
      action_space: { steering_angle: range(-25, 25), speed: range(0.5, 3) },
      sensor: ["observation"],
      training_algorithm: "sac",
    };
    const said = saidBy("model_metadata.json", JSON.stringify(metadata));
    expect(said.space).toMatchObject({ kind: "continuous", steering_angle: [-25, 25], speed: [0.5, 3] });
    expect(said).toMatchObject({ sensors: [], algorithm: "sac" });
  });

  it("is refused where it says nothing of a model", () => {
    expect(refusal("a.py", "x = 1")).toBe("aws_file_no_reward");
    expect(refusal("a.json", "{")).toBe("aws_file_no_json");
    expect(refusal("a.json", "[1]")).toBe("aws_file_unknown");
    expect(refusal("a.json", '{"a": 1}')).toBe("aws_file_unknown");
    expect(refusal("a.json", '{"action_space": []}')).toBe("aws_file_actions");
    expect(refusal("a.json", '{"action_space": [{"speed": 1}]}')).toBe("aws_file_actions");
    expect(refusal("a.json", '{"action_space": [{"speed": 1, "steering_angle": "x"}]}')).toBe("aws_file_actions");
    expect(refusal("a.json", '{"action_space": {"speed": {"low": 1, "high": 2}}}')).toBe("aws_file_actions");
    expect(refusal("a.json", " ".repeat((1 << 20) + 1))).toBe("aws_file_large");
  });
});
