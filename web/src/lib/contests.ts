/** What heats and ladders are called. */
import type { ContestCard, Ghost } from "../api/contests";
import type { Key } from "../i18n/en";
import { t } from "../i18n/index.svelte";
import { ofStamp } from "./dates";

/** How they race: a heat by its cars, a ladder by what it compares by. */
export const kindOf = (contest: Pick<ContestCard, "kind" | "models">): string =>
  contest.kind === "grid" ? t("contests_kind_grid", { count: contest.models.length }) : ladderKind(contest.kind);

export const LADDER_KINDS = ["head-to-model", "time-trial", "object-avoidance", "head-to-bot"] as const;

export const ladderKind = (kind: string): string =>
  t(kind === "head-to-model" ? "contests_kind_head_to_model" : (`races_kind_${kind.replaceAll("-", "_")}` as Key));

/** How many laps, in words. */
export const lapsOf = (count: number): string => t("races_laps_count", { count });

/** What a heat or a ladder is called. */
export const contestName = (contest: Pick<ContestCard, "title" | "models" | "is_ladder">): string =>
  contest.title || contest.models.join(contest.is_ladder ? ", " : " – ");

/** A ghost of a film, by what there is to know of earlier heats. */
export function ghostName(ghost: Ghost, heats: ContestCard[]): string {
  if (ghost === "best-lap") return t("contests_ghost_best_lap");
  if ("evaluation" in ghost) return `${ghost.model} · ${ofStamp(ghost.evaluation)}`;
  if ("model" in ghost) return ghost.checkpoint === "best" ? ghost.model : `${ghost.model}@${ghost.checkpoint}`;
  const heat = heats.find((one) => one.id === ghost.heat);
  return heat ? contestName(heat) : t("contests_ghost_heats");
}
