/** What a reward pays along a track: racecraft.reward.painting, with the same laps. A car drives them beside each other at
 * a usual speed, step after step, and some of the steps are painted. Objects stand where an episode begins with them. */
import type { RewardPainting } from "../api/client";
import { thingsOn, type Among } from "./among";
import type { Core } from "./core";
import { HALF_CAR, momentOn, SPEED, STEP, type Words } from "./moments";
import type { TrackFile } from "./plan";
import { RewardFailure, type Pay } from "./python";
import { Road, roundHalfEven } from "./road";

const PLACES = 96; // along the track
const OFFSETS = [-1.15, -0.9, -0.6, -0.3, 0, 0.3, 0.6, 0.9, 1.15]; // shares of half the width, left positive

/** Laps to be paid for, a list of rows for each of the offsets, and which of the rows are painted. */
export function lapsBeside(track: TrackFile, words: Words): { laps: Float64Array[][]; rows: number[] } {
  const [road, on] = [new Road(track, false), momentOn(track, false, words)];
  const { length, isClosed } = road;
  const parts = isClosed ? PLACES : PLACES - 1;
  const between = Math.max(1, roundHalfEven(length / parts / (SPEED * STEP)));
  const count = between * parts + (isClosed ? 1 : 2);
  const laps = OFFSETS.map((): Float64Array[] => []);
  for (let step = 0; step < count; step++) {
    const ahead = (step - 1) / (between * parts); // the first of an episode is not paid for
    const s = length * (isClosed ? ahead : Math.max(ahead, 0));
    const half = road.widthAt(s) / 2;
    OFFSETS.forEach((share, lap) => {
      const offset = half * share;
      const isOnTrack = Math.abs(offset) + HALF_CAR <= half;
      const status = Math.abs(offset) > half + HALF_CAR ? "off_track" : "in_progress";
      laps[lap]!.push(on(s, { steps: step + 2, offset, isOnTrack, status }));
    });
  }
  return { laps, rows: Array.from({ length: PLACES }, (_, place) => 1 + place * between) };
}

/** The painting of a reward for one car, among the objects of a race; laps are null from the one on in which it failed. `isWanted` is asked before every
 * lap, and where it is not any more, there is no painting. */
export async function paint(
  open: () => Pay,
  core: Core,
  track: TrackFile,
  about: Among,
  isWanted: () => Promise<boolean>,
): Promise<RewardPainting | undefined> {
  const words = { columns: core.names("row"), statuses: about.statuses };
  const { laps, rows } = lapsBeside(track, words);
  const road = thingsOn(core, track, about);
  const things = road?.placed(0) ?? [];
  const paid: (number | null)[][] = laps.map(() => rows.map(() => null));
  try {
    const pay = open();
    for (const [number, lap] of laps.entries()) {
      if (!(await isWanted())) return undefined;
      const all = lap.map((row) => pay(road ? Float64Array.from(road.among(row, things)) : row)[0]!);
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
    objects: things.map((one) => [rounded(one["object_x"]!), rounded(one["object_y"]!)]),
  };
}

const rounded = (metres: number) => Math.round(1000 * metres) / 1000;
