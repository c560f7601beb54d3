/** What a reward pays for laps that were driven: racecraft.analysis.paid_laps, over the rows themselves. */
import type { Pay } from "../python";
import type { DrivenLap } from "./laps";

const FIRST = 2; // number of an episode's first step that is paid
const STANDING = ["prepare", "pause", "park"]; // in which nobody asks

/** A lap's rows to be paid one after the other, and which of the lap's rows each is; -1 of one that only goes before. */
export interface ToPay {
  rows: Float64Array[];
  places: number[];
  count: number; // rows of the whole lap
}

export function toPay({ rows, before }: DrivenLap, columns: string[], statuses: string[]): ToPay {
  const [steps, progress, status] = ["steps", "progress", "status"].map((name) => columns.indexOf(name)) as [
    number,
    number,
    number,
  ];
  const places = rows.flatMap((row, at) => (STANDING.includes(statuses[row[status]!]!) ? [] : [at]));
  const driven = places.map((at) => rows[at]!.slice());
  const first = driven[0];
  // as in a training every lap is an episode of its own; one that began at speed has a step before it
  if (!first || !before || !(first[steps]! > FIRST)) return { rows: driven, places, count: rows.length };
  const earlier = before.slice();
  earlier[progress]! -= 1; // of the lap that begins
  const shift = FIRST - earlier[steps]!;
  const all = [earlier, ...driven];
  for (const row of all) row[steps]! += shift;
  return { rows: all, places: [-1, ...places], count: rows.length };
}

/** Rewards of every row of every lap, null where nobody asks. */
export function payLaps(pay: Pay, laps: ToPay[]): (number | null)[][] {
  return laps.map(({ rows, places, count }) => {
    const paid = new Array<number | null>(count).fill(null);
    rows.forEach((row, index) => {
      const reward = pay(row)[0]!;
      if (places[index]! >= 0) paid[places[index]!] = reward;
    });
    return paid;
  });
}
