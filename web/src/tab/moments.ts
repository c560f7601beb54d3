/** Moments that a car can be in on a track, as the rows that the simulation would report: racecraft.reward.dry_run. */
import { curvatureOf } from "./laps/bends";
import { indicesOf, type TrackFile } from "./plan";
import { Road, wrapAngle } from "./road";

/** What the numbers of a row are called. */
export interface Words {
  columns: string[];
  statuses: string[];
}

export const STEP = 1 / 15; // s between two calls for the same car
export const SPEED = 1.5; // m/s
export const HALF_CAR = 0.08; // m from the car's middle line to its wheels
const BEFORE_LINE = 0.05; // m at most that the last place of a lap is before its end
const FRONT = 0.14; // m from the car's origin to the point that x, y and progress mean

export interface Moment {
  steps?: number;
  speed?: number; // m/s
  steering?: number; // rad
  offset?: number; // m, left positive
  turned?: number; // rad, from the road's heading
  progress?: number; // 0 to 1
  isOnTrack?: boolean; // all wheels
  status?: string;
}

/** Rows on a track in one direction: of a car `s` metres along it. */
export function momentOn(track: TrackFile, isReversed: boolean, { columns, statuses }: Words) {
  const [road, indices] = [new Road(track, isReversed), indicesOf(track, isReversed)];
  const at = Object.fromEntries(columns.map((name, index) => [name, index]));
  return (s: number, moment: Moment = {}): Float64Array => {
    const { steps = 50, speed = SPEED, steering = 0, offset = 0, turned = 0 } = moment;
    const { progress = s / road.length, isOnTrack = true, status = "in_progress" } = moment;
    const [heading, [x, y]] = [road.headingAt(s), road.pointAt(s)];
    const place = road.isClosed ? road.onTrack(s) : Math.min(s, road.length);
    const before = indices[road.pieceOf(place)]!;
    const values: Record<string, number> = {
      ...{ steps, time: steps * STEP, progress, heading: turned ? wrapAngle(heading + turned) : heading },
      ...{ x: x - offset * Math.sin(heading), y: y + offset * Math.cos(heading), offset },
      ...{ speed, actual_speed: speed, steering_angle: steering, actual_steering_angle: steering },
      ...{ projection_distance: place, track_width: road.widthAt(s), track_length: road.length },
      ...{ closest_prev: before, closest_next: before + 1, all_wheels_on_track: Number(isOnTrack) },
      ...{ is_offtrack: Number(status === "off_track"), is_crashed: Number(status === "crashed") },
      ...{ is_reversed: Number(isReversed), track_index: Number(isReversed) },
      ...{ status: statuses.indexOf(status), lap: Number(status === "lap_complete") },
    };
    const row = new Float64Array(columns.length);
    for (const [name, value] of Object.entries(values)) row[at[name]!] = value;
    return row;
  };
}

/** The moments that a reward is tried in. */
export function momentsOf(track: TrackFile, words: Words): TrackFile["situations"] {
  const road = new Road(track, false);
  const { length } = road;
  const [on, back] = [momentOn(track, false, words), momentOn(track, true, words)];
  const curvature = curvatureOf(road);
  const places = Array.from({ length: 400 }, (_, at) => (0.1 + (at * 0.8) / 399) * length);
  const bends = places.map(curvature);
  const first = (best: (a: number, b: number) => boolean, of = bends) =>
    places[of.reduce((found, bend, at) => (best(bend, of[found]!) ? at : found), 0)]!;
  const straight = first(
    (a, b) => a < b,
    bends.map((bend) => Math.abs(bend)),
  );
  const [left, right] = [first((a, b) => a > b), first((a, b) => a < b)];
  const half = road.widthAt(straight) / 2;
  const beforeLine = length - Math.min(BEFORE_LINE, (length - road.arc.at(-2)!) / 2); // between the last two waypoints
  const degrees = Math.PI / 180;
  const told: [string, Float64Array][] = [
    ["start", on(FRONT, { steps: 2, progress: FRONT / length })],
    ["straight", on(straight, { steps: 40 })],
    ["bend left", on(left, { steps: 60, steering: 20 * degrees })],
    ["bend right", on(right, { steps: 80, steering: -20 * degrees })],
    ["slow", on(straight, { speed: 0.5 })],
    ["fast", on(straight, { speed: 4 })],
    ["left edge", on(straight, { steps: 90, offset: half, isOnTrack: false })],
    ["right edge", on(straight, { steps: 90, offset: -(half - HALF_CAR - 0.03) })],
    ["sideways", on(straight, { steps: 90, turned: 80 * degrees })],
    ["backwards", on(straight, { steps: 90, turned: Math.PI })],
    ["off track", on(straight, { steps: 95, offset: -(half + 0.2), isOnTrack: false, status: "off_track" })],
    ["other way", back(length - straight, { steps: 40 })],
    ["on pace", on((length * 2) / 3, { steps: 100, progress: 2 / 3 })],
    ["before the line", on(beforeLine, { steps: 195 })],
    ["finish", on(length, { steps: 200, progress: 1, status: "lap_complete" })],
  ];
  return told.map(([name, row]) => ({ name, description: name, row: [...row] }));
}
