/** The parts of a training between two changes: which one a step belongs to, and where its band lies on a curve. */
import type { TrainingStretch } from "../api/client";
import type { Key } from "../i18n/en";
import { completionOf, fastestOf, type Point } from "./curves";

/** Told apart by all eyes beside each other, on light and dark. */
const COLORS = ["#7f8a98", "#4ea8ff", "#e0a100", "#2fa37c", "#c655b8", "#e2662c"];

export const colorOf = (number: number): string => COLORS[(number - 1) % COLORS.length]!;

/** The stretch that trained up to a step: the last one that began before it. */
export const stretchAt = <S extends { step: number }>(stretches: S[], step: number): S =>
  stretches.findLast((stretch) => stretch.step < step) ?? stretches[0]!;

/** The checkpoint to branch off from: of those of a stretch the best, else the last. */
export const branchOf = <C extends { step: number; stretch: number; is_best: boolean }>(
  checkpoints: C[],
  number: number,
): C | undefined => {
  const own = checkpoints.filter((one) => one.stretch === number).sort((a, b) => a.step - b.step);
  return own.find((one) => one.is_best) ?? own[own.length - 1];
};

export interface Band {
  /** Of the stretch. */ number: number;
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
    found.push({
      number: stretch.number,
      from,
      to: at(own[own.length - 1]!),
      color: colorOf(stretch.number),
      label: label(stretch),
    });
  });
  return found;
}

const FEW = 3; // evaluations that are looked at on either side of a change

export interface Turn<S> {
  stretch: S;
  /** s, the best of the last evaluations before the change, and of the last ones now; null where no lap was driven. */
  laps: [number | null, number | null];
  /** Mean completion of the same. */
  completions: [number, number];
}

/** What the last change made of the model; undefined where there was none, or it was not judged yet. */
export function lastTurn<S extends { step: number }>(stretches: S[], evaluations: Point[]): Turn<S> | undefined {
  const last = evaluations[evaluations.length - 1];
  if (!last || stretches.length < 2) return undefined;
  const stretch = stretchAt(stretches, last.step);
  const own = evaluations.filter((point) => stretchAt(stretches, point.step) === stretch).slice(-FEW);
  const before = evaluations.filter((point) => point.step <= stretch.step).slice(-FEW);
  if (!before.length) return undefined;
  const mean = (points: Point[]) => points.reduce((sum, point) => sum + completionOf(point), 0) / points.length;
  return {
    stretch,
    laps: [fastestOf(before, null), fastestOf(own, null)],
    completions: [mean(before), mean(own)],
  };
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
