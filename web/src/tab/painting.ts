/** What a reward pays along a track: racecraft.reward.painting, with the same laps. A car drives them beside each other at
 * a usual speed, step after step, and some of the steps are painted. */
import type { RewardPainting } from "../api/client";
import { indicesOf, type TrackFile } from "./plan";
import { RewardFailure, type Pay } from "./python";
import { Road, roundHalfEven } from "./road";

const PLACES = 96; // along the track
const OFFSETS = [-1.15, -0.9, -0.6, -0.3, 0, 0.3, 0.6, 0.9, 1.15]; // shares of half the width, left positive
const STEP = 1 / 15; // s
const SPEED = 1.5; // m/s
const HALF_CAR = 0.08; // m from the car's middle line to its wheels

/** What the numbers of a row are called. */
export interface Words {
  columns: string[];
  statuses: string[];
}

/** Laps to be paid for, a list of rows for each of the offsets, and which of the rows are painted. */
export function lapsBeside(track: TrackFile, { columns, statuses }: Words): { laps: Float64Array[][]; rows: number[] } {
  const [road, indices] = [new Road(track, false), indicesOf(track)];
  const { length, isClosed } = road;
  const parts = isClosed ? PLACES : PLACES - 1;
  const between = Math.max(1, roundHalfEven(length / parts / (SPEED * STEP)));
  const count = between * parts + (isClosed ? 1 : 2);
  const at = Object.fromEntries(columns.map((name, index) => [name, index]));
  const laps = OFFSETS.map((): Float64Array[] => []);
  for (let step = 0; step < count; step++) {
    const ahead = (step - 1) / (between * parts); // the first of an episode is not paid for
    const s = length * (isClosed ? ahead : Math.max(ahead, 0));
    const [heading, [x, y]] = [road.headingAt(s), road.pointAt(s)];
    const [place, half] = [isClosed ? road.onTrack(s) : Math.min(s, length), road.widthAt(s) / 2];
    const before = indices[road.pieceOf(place)]!;
    OFFSETS.forEach((share, lap) => {
      const offset = half * share;
      const isOff = Math.abs(offset) > half + HALF_CAR;
      const values: Record<string, number> = {
        ...{ steps: step + 2, time: (step + 2) * STEP, progress: s / length, heading },
        ...{ x: x - offset * Math.sin(heading), y: y + offset * Math.cos(heading), offset },
        ...{ speed: SPEED, actual_speed: SPEED, projection_distance: place, track_width: 2 * half },
        ...{ track_length: length, closest_prev: before, closest_next: before + 1 },
        ...{ all_wheels_on_track: Number(Math.abs(offset) + HALF_CAR <= half), is_offtrack: Number(isOff) },
        status: statuses.indexOf(isOff ? "off_track" : "in_progress"),
      };
      const row = new Float64Array(columns.length);
      for (const [name, value] of Object.entries(values)) row[at[name]!] = value;
      laps[lap]!.push(row);
    });
  }
  return { laps, rows: Array.from({ length: PLACES }, (_, place) => 1 + place * between) };
}

/** The painting of a reward for one car; laps are null from the one on in which it failed. `isWanted` is asked before every
 * lap, and where it is not any more, there is no painting. */
export async function paint(
  open: () => Pay,
  track: TrackFile,
  words: Words,
  isWanted: () => Promise<boolean>,
): Promise<RewardPainting | undefined> {
  const { laps, rows } = lapsBeside(track, words);
  const paid: (number | null)[][] = laps.map(() => rows.map(() => null));
  try {
    const pay = open();
    for (const [number, lap] of laps.entries()) {
      if (!(await isWanted())) return undefined;
      const all = lap.map((row) => pay(row)[0]!);
      paid[number] = rows.map((row) => all[row]!);
    }
  } catch (error) {
    if (!(error instanceof RewardFailure)) throw error;
  }
  const [x, y] = ["x", "y"].map((name) => words.columns.indexOf(name)) as [number, number];
  const parts = rows.length - (track.told.isClosed ? 0 : 1);
  return {
    places: rows.map((_, place) => rounded((new Road(track, false).length * place) / parts)),
    offsets: OFFSETS,
    points: rows.map((row) => laps.map((lap) => [rounded(lap[row]![x]!), rounded(lap[row]![y]!)])),
    rewards: rows.map((_, place) => paid.map((lap) => lap[place]!)),
  };
}

const rounded = (metres: number) => Math.round(1000 * metres) / 1000;
