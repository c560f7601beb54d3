/** Why an archive cannot be taken here: a text of the page, with what fills it in. */
import type { TabKey } from "./en";

export type ArrivalKey = TabKey & `arrive_${string}`;

export class ArrivalProblem extends Error {
  constructor(
    readonly key: ArrivalKey,
    readonly values: Record<string, string | number> = {},
  ) {
    super(key);
  }
}
