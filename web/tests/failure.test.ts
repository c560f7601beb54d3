import { expect, test } from "vitest";
import { failureOf } from "../src/lib/failure";

test("a sentence, the line and the long part are told apart", () => {
  const message =
    "reward_function.py, line 3: the reward function divided by zero.\n    return 1 / x\nIt was called with params = {\n  'x': 0}";
  expect(failureOf({ code: "RewardError", message, hint: "", line: 3 })).toEqual({
    sentence: "reward_function.py, line 3: the reward function divided by zero.",
    hint: "",
    line: 3,
    code: "return 1 / x",
    details: "It was called with params = {\n  'x': 0}",
    isReward: true,
  });
  expect(failureOf({ code: "RunError", message: "The disk is full.", hint: "Free some.", line: null })).toMatchObject({
    sentence: "The disk is full.",
    hint: "Free some.",
    code: "",
    isReward: false,
  });
});
