import type { TuningCard, TuningTrial } from "../api/tunings";

/** Trials under way, then completed ones, the best first, then the others in the order they began. */
export function ranked(trials: TuningTrial[]): TuningTrial[] {
  const isDone = (trial: TuningTrial) => trial.state === "complete" && trial.value !== null;
  const isUnderWay = (trial: TuningTrial) => trial.state === "running";
  return [
    ...trials.filter(isUnderWay),
    ...trials.filter(isDone).sort((a, b) => a.value! - b.value! || a.number - b.number),
    ...trials.filter((trial) => !isDone(trial) && !isUnderWay(trial)),
  ];
}

/** The trial with the numbers that the model has. */
export function yours(search: TuningCard): TuningTrial | undefined {
  return search.trials.find(
    (trial) => trial.value !== null && search.space.every((number) => trial.params[number.name] === number.default),
  );
}

/** What each completed trial came to, and the best until then. */
export function bestSoFar(trials: TuningTrial[]): { number: number; value: number; best: number }[] {
  let best = Infinity;
  return trials
    .filter((trial) => trial.state === "complete" && trial.value !== null)
    .map((trial) => ({ number: trial.number, value: trial.value!, best: (best = Math.min(best, trial.value!)) }));
}
