/** Laps of an evaluation on one axis of place, so that two of them can be laid over each other. */
export interface LapTrace {
  number: number;
  seconds: number;
  place: number[];
  speed: (number | null)[];
  steering: (number | null)[];
  reward: (number | null)[];
}

const PLACES = 200;

/** Split AWS's columns into complete laps; each is put on the same places by the driven distance along the lap. */
export function splitLaps(columns: Record<string, (number | string)[]>): LapTrace[] {
  const column = (name: string) => (columns[name] ?? []) as number[];
  const [episode, progress, x, y, time] = ["episode", "progress", "X", "Y", "tstamp"].map(column) as [number[], number[], number[], number[], number[]];
  const laps: LapTrace[] = [];
  let start = 0;
  for (let row = 1; row <= episode.length; row++) {
    if (row < episode.length && episode[row] === episode[start]) continue;
    const status = columns["episode_status"]?.[row - 1];
    if (status === "lap_complete" && row - start > 10) {
      let driven = 0;
      for (let i = start + 1; i < row; i++) driven += Math.hypot(x[i]! - x[i - 1]!, y[i]! - y[i - 1]!);
      const place = Array.from({ length: PLACES }, (_, index) => (driven * index) / (PLACES - 1));
      const shares = progress.slice(start, row).map((value) => Math.max(0, value) / 100);
      const along = (name: string) => resample(shares, column(name).slice(start, row));
      laps.push({
        number: Math.round(episode[start]!) + 1,
        seconds: time[row - 1]! - time[start]!,
        place,
        speed: along("throttle"),
        steering: along("steer"),
        reward: along("reward"),
      });
    }
    start = row;
  }
  return laps;
}

/** Values at equal shares of the lap, from values at the shares where they were taken. */
export function resample(shares: number[], values: number[]): (number | null)[] {
  const found: (number | null)[] = [];
  let row = 0;
  for (let index = 0; index < PLACES; index++) {
    const share = index / (PLACES - 1);
    while (row + 1 < shares.length && shares[row + 1]! <= share) row++;
    found.push(values[row] ?? null);
  }
  return found;
}
