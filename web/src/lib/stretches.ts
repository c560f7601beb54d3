/** The parts of a training between two changes: which one a step belongs to, and where its band lies on a curve. */
import type { TrainingStretch } from "../api/client";
import type { Key } from "../i18n/en";
import type { Point } from "./curves";

/** Told apart by all eyes beside each other, on light and dark. */
const COLORS = ["#7f8a98", "#4ea8ff", "#e0a100", "#2fa37c", "#c655b8", "#e2662c"];

export const colorOf = (number: number): string => COLORS[(number - 1) % COLORS.length]!;

/** The stretch that trained up to a step: the last one that began before it. */
export const stretchAt = <S extends { step: number }>(stretches: S[], step: number): S =>
  stretches.findLast((stretch) => stretch.step < step) ?? stretches[0]!;

export interface Band {
  from: number;
  to: number;
  color: string;
  label: string;
}

/** Bands of a curve over time, steps or whatever `at` says of a point; none where nothing was ever changed. */
export function bandsOf(
  stretches: TrainingStretch[],
  points: Point[],
  at: (point: Point) => number,
  label: (stretch: TrainingStretch) => string,
): Band[] {
  if (stretches.length < 2 || points.length === 0) return [];
  const found: Band[] = [];
  stretches.forEach((stretch, index) => {
    const own = points.filter((point) => stretchAt(stretches, point.step) === stretch);
    if (!own.length) return;
    const before = found[found.length - 1];
    const from = index === 0 || !before ? at(own[0]!) : before.to;
    found.push({ from, to: at(own[own.length - 1]!), color: colorOf(stretch.number), label: label(stretch) });
  });
  return found;
}

const CHANGES: Record<string, Key> = {
  reward: "change_reward",
  actions: "change_actions",
  model_metadata: "change_model_metadata",
  hyperparameters: "change_hyperparameters",
  track: "change_track",
  vehicle: "change_vehicle",
  settings: "change_settings",
};

/** What was changed when a stretch began, as keys of texts. */
export const changesOf = (stretch: TrainingStretch): Key[] => {
  const keys = stretch.changes.map((change) => CHANGES[change] ?? "change_settings");
  return keys.length ? [...new Set(keys)] : ["change_begin"];
};
