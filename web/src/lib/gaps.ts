/** What a graph of gaps shows: cars that are close, told apart, and of one that is far away only where it leaves. */

/** s: less is close, whoever drives. */
const CLOSE = 1;
/** How many times as far as the others a car has to be before the graph lets it go. */
const FAR = 4;

type Gaps = (number | null)[];

/** A car that leaves a graph: at which of its points, and how far it is away there and later at the most, s. */
export interface Leaving {
  index: number;
  most: number;
}

const sizes = (gaps: Gaps): number[] =>
  gaps.filter((gap): gap is number => gap !== null && gap !== 0).map((gap) => Math.abs(gap));

/** Seconds to either side that hold all that is close; undefined where that is everything.
 *
 *  Of each car what it mostly is away counts, not its worst moment; and going up from the closest one, a car that is
 *  four times as far away as all before it is another race.
 */
export function reachOf(cars: Gaps[]): number | undefined {
  const away = cars.map(sizes).filter((one) => one.length);
  if (!away.length) return undefined;
  const usual = away.map((one) => {
    const sorted = [...one].sort((a, b) => a - b);
    return Math.max(CLOSE, Math.min(sorted.at(-1)!, FAR * sorted[Math.floor((sorted.length - 1) / 2)]!));
  });
  usual.sort((a, b) => a - b);
  const reach = usual.reduce((most, one) => (one <= FAR * most ? Math.max(most, one) : most), usual[0]!);
  const most = Math.max(...away.map((one) => one.reduce((a, b) => Math.max(a, b))));
  return most > reach ? reach : undefined;
}

/** Where a car is farther away than a graph reaches; undefined of one that never is. */
export function leavingOf(gaps: Gaps, reach: number): Leaving | undefined {
  const index = gaps.findIndex((gap) => gap !== null && Math.abs(gap) > reach);
  if (index < 0) return undefined;
  const later = gaps.slice(index).filter((gap): gap is number => gap !== null);
  return { index, most: later.reduce((most, gap) => (Math.abs(gap) > Math.abs(most) ? gap : most)) };
}
