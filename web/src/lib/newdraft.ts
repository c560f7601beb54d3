/** What was typed for a new model: it outlives a look elsewhere and a reload, until the model is made. */
import type { ActionPreset } from "../api/client";
import type { Wishes } from "./newmodel";
import { tab } from "./remembered";

const KEY = "racecraft-new-model";

export type Typed = Omit<Wishes, "space"> & { space: ActionPreset | undefined };

export function typed(): Partial<Typed> {
  try {
    const found: unknown = JSON.parse(tab.read(KEY) ?? "{}");
    return found !== null && typeof found === "object" ? (found as Partial<Typed>) : {};
  } catch {
    return {};
  }
}

export function keepTyped(now: Typed | undefined): void {
  tab.write(KEY, now ? JSON.stringify(now) : null);
}
