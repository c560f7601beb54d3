/** What is used of what may be, in words. */
import type { QuotaInfo, UsageInfo } from "./api";
import { l } from "./text";

export type Quantity = "minutes" | "models" | "places";

/** "12 of 60", or the number alone where nothing limits it. */
export function used(what: Quantity, usage: UsageInfo, limits: QuotaInfo): string {
  const count = Math.floor(usage[what]);
  const limit = limits[what];
  return limit == null ? String(count) : l("quota_of", { count, limit });
}
