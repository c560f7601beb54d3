/** Why a replay cannot be driven here: a text of the page, with what fills it in. */
import type { TabKey } from "../en";

export type ProblemKey = TabKey & `replay_${string}`;

export class ReplayProblem extends Error {
  constructor(
    readonly key: ProblemKey,
    readonly values: Record<string, string | number> = {},
  ) {
    super(key);
  }
}
