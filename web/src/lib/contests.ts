/** What heats and ladders are called. */
import type { ContestCard, Ghost } from "../api/contests";
import type { RaceReplay } from "../api/races";
import type { Key } from "../i18n/en";
import { t } from "../i18n/index.svelte";
import { moment, ofStamp } from "./dates";
import { plain } from "./numbers";

/** How they race: a heat by its cars, a ladder by what it compares by. */
export const kindOf = (contest: Pick<ContestCard, "kind" | "models">): string =>
  contest.kind === "grid" ? t("contests_kind_grid", { count: contest.models.length }) : ladderKind(contest.kind);

export const LADDER_KINDS = ["head-to-model", "time-trial", "object-avoidance", "head-to-bot"] as const;

export const ladderKind = (kind: string): string =>
  t(kind === "head-to-model" ? "contests_kind_head_to_model" : (`races_kind_${kind.replaceAll("-", "_")}` as Key));

/** Models that take part. */
export const MOST = { heat: 8, ladder: 20 };

/** What stands on the button that starts one with so many, or why it starts none. */
export function startOf(form: keyof typeof MOST, count: number): string {
  if (count < 2) return t("contests_choose");
  return count > MOST[form] ? t(`contests_many_${form}`, { most: MOST[form] }) : t(`contests_go_${form}`, { count });
}

/** How many laps, in words. */
export const lapsOf = (count: number): string => t("races_laps_count", { count });

/** What a heat or a ladder is called. */
export const contestName = (contest: Pick<ContestCard, "title" | "models" | "is_ladder">): string =>
  contest.title || contest.models.join(contest.is_ladder ? ", " : " – ");

/** A ghost of a film, by what there is to know of earlier heats. */
export function ghostName(ghost: Ghost, heats: ContestCard[]): string {
  if (ghost === "best-lap") return t("contests_ghost_best_lap");
  if ("evaluation" in ghost) return `${ghost.model} (${ofStamp(ghost.evaluation)})`;
  if ("model" in ghost) return ghost.checkpoint === "best" ? ghost.model : `${ghost.model}@${ghost.checkpoint}`;
  const heat = heats.find((one) => one.id === ghost.heat);
  return heat ? `${contestName(heat)} (${moment(heat.created)})` : t("contests_ghost_heats");
}

/** The same in full, where all heats that there are are known. */
export function toldGhost(ghost: Ghost, heats: ContestCard[]): string {
  if (typeof ghost === "string" || !("heat" in ghost)) return ghostName(ghost, heats);
  const heat = heats.find((one) => one.id === ghost.heat);
  if (!heat) return t("contests_ghost_heat_gone");
  return t("contests_ghost_heat", { name: contestName(heat), when: moment(heat.created) });
}

/** What is called alike, told apart. */
export const apart = (names: string[]): string[] =>
  names.map((name, index) => {
    const before = names.slice(0, index).filter((one) => one === name).length;
    return before ? `${name} (${plain(before + 1)})` : name;
  });

/** Ghosts of a film as its legend has them; behind a name may stand of which evaluation it is. */
export const ghostLabels = (ghosts: RaceReplay["ghosts"]): string[] =>
  apart(
    ghosts.map(({ name, is_lap }) =>
      is_lap ? t("contests_ghost_best_lap") : name.replace(/ (\d{14})$/, (_, stamp: string) => ` (${ofStamp(stamp)})`),
    ),
  );
