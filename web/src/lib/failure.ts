/** An error of a training, taken apart: a sentence, the line of code, and what is long. */
import type { JobInfo } from "../api/client";

export interface Failure {
  sentence: string;
  hint: string;
  /** Of the reward function, from 1; null where it is not at fault. */
  line: number | null;
  /** What stands in that line. */
  code: string;
  /** Params, what was printed. */
  details: string;
  isReward: boolean;
}

export function failureOf(error: NonNullable<JobInfo["error"]>): Failure {
  const [sentence = "", ...rest] = String(error["message"] ?? "").split("\n");
  const line = typeof error["line"] === "number" ? error["line"] : null;
  const code = line !== null && rest[0]?.startsWith("    ") ? rest.shift()!.trim() : "";
  return {
    sentence,
    hint: String(error["hint"] ?? ""),
    line,
    code,
    details: rest.join("\n").trim(),
    isReward: error["code"] === "RewardError",
  };
}
