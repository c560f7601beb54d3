/** The marshal of an evaluation or a race: counts laps and mistakes, and puts cars back. racecraft.race.marshal, operation
 * by operation; the same rows come out, to the bit. */
import type { Cars, Core } from "../core";
import type { Lap, Rules } from "./header";
import { avoidingPose, clearPose, RESET_STATUSES, startDistance, startPose, type Thing } from "../placement";
import { roundHalfEven, type Point, type Road } from "../road";

export const CONTROL_DT = 1 / 15; // s
const REFERENCE_AHEAD = 0.14; // m from the car's origin to the point that x and y speak of
const GONE = 5; // of racecraft.sim.objects.OBJECT_KINDS
const [HEADER, THING] = [4, 7]; // columns of all objects, of each

export interface Course {
  core: Core;
  cars: Cars;
  road: Road; // in driving direction
  rules: Rules;
  seed: bigint;
  carsPerRace: number;
  numObjects: number; // boxes and bots
  columns: string[];
  statuses: string[];
}

export interface Driven {
  laps: Lap[];
  status: string; // empty while it races
  completion: number;
}

interface Judged {
  index: number;
  resetsLeft: number;
  start: number; // m along the track where its laps begin
  status: string;
  last: Float64Array[]; // its two last rows
  laps: Lap[];
  began: number; // s on the clock when the present episode began
  lapsBefore: number; // laps completed before that
  mistakes: Record<string, number>; // of the present lap
  crashes: Map<number, number>; // of the trial, by object
  resets: number; // in the present lap
  penalty: number; // s, in the present lap
}

const SEEDED = "lap"; // rules by which cars start where a draw from the seed puts them

export class Marshal {
  private readonly judged: Judged[];
  private readonly at: Record<string, number>;

  /** `log` is told every row of a car, in their order. */
  private constructor(
    private readonly course: Course,
    private readonly log: (car: number, row: Float64Array) => void,
  ) {
    this.at = Object.fromEntries(course.columns.map((name, index) => [name, index]));
    this.judged = Array.from({ length: course.cars.count }, (_, index) => ({
      ...{ index, resetsLeft: course.rules.max_resets, start: 0, status: "", last: [], laps: [], began: 0 },
      ...{ lapsBefore: 0, mistakes: {}, crashes: new Map<number, number>(), resets: 0, penalty: 0 },
    }));
  }

  /** Line the cars up. `isRandom`: every episode has its own conditions. */
  static async begin(
    course: Course,
    isRandom: boolean,
    log: (car: number, row: Float64Array) => void,
  ): Promise<Marshal> {
    const { core, cars, road, rules, seed, carsPerRace } = course;
    const races = Array.from({ length: cars.count }, (_, car) => Math.floor(car / carsPerRace));
    if (rules.starts === SEEDED) cars.reset(undefined, await keysOf(seed, races));
    else if (isRandom) {
      const key = (seed % (1n << 32n)) << 20n;
      cars.reset(
        undefined,
        BigUint64Array.from(races, (race) => BigInt(race) + key),
      );
    } else cars.reset();
    const marshal = new Marshal(course, log);
    if (rules.starts !== SEEDED && carsPerRace === 1)
      for (let trial = 1; trial < cars.count; trial++) {
        const offset = marshal.startOffset(trial);
        const { x, y, heading } = startPose(core, road, rules, { seed, trial, lap: 0, offset });
        cars.setPose(trial, x, y, heading);
      }
    for (const car of marshal.judged) marshal.logStart(car);
    return marshal;
  }

  get isRacing(): boolean {
    return this.judged.some((car) => !car.status);
  }

  /** Step the cars, take note of what happened and do what the rules ask for. */
  step(actions: Float32Array): void {
    const { cars, rules, statuses } = this.course;
    const { at } = this;
    cars.step(actions);
    const rows = cars.rows.slice();
    const ended = cars.terminated.map((flag, car) => flag | cars.truncated[car]!);
    for (const car of this.judged) {
      if (car.status) continue;
      const row = rows.subarray(car.index * cars.rowWidth, (car.index + 1) * cars.rowWidth);
      row[at["lap"]!]! += car.lapsBefore;
      const clock = car.began + row[at["time"]!]!;
      const status = statuses[row[at["status"]!]!]!;
      if (status === "pause")
        // the core keeps the progress of the mistake; log where the car stands
        row[at["progress"]!] = this.progress(car, row[at["projection_distance"]!]!, row[at["progress"]!]!);
      const isTimeUp = rules.time_limit > 0 && clock >= rules.time_limit - 0.5 * CONTROL_DT;
      if (isTimeUp) row[at["status"]!] = statuses.indexOf("time_up");
      this.take(car, row);
      if (isTimeUp) this.end(car, row, clock);
      else if (status === "lap_complete" || ended[car.index]) this.event(car, row, clock);
    }
  }

  results(): Driven[] {
    return this.judged.map(({ laps, status }) => ({
      laps,
      status,
      completion: laps.reduce((sum, lap) => sum + lap.completion, 0) / this.course.rules.laps,
    }));
  }

  private take(car: Judged, row: Float64Array): void {
    car.last = [...car.last.slice(-1), row];
    this.log(car.index, row);
  }

  private event(car: Judged, row: Float64Array, clock: number): void {
    const { cars, rules, statuses } = this.course;
    const status = statuses[row[this.at["status"]!]!]!;
    if (status === "lap_complete") {
      this.finishLap(car, row, clock);
      if (car.laps.length === rules.laps) car.status = status;
      else if (cars.terminated[car.index]) this.startAgain(car, clock);
      return;
    }
    const isMistake = RESET_STATUSES.includes(status); // else the limit on steps
    if (isMistake) car.mistakes[status] = (car.mistakes[status] ?? 0) + 1;
    if (isMistake && car.resetsLeft > 0) this.putBack(car, status);
    else this.end(car, row, clock);
  }

  private putBack(car: Judged, status: string): void {
    const { cars, road, rules, columns, carsPerRace } = this.course;
    const { at } = this;
    const [previous, row] = [car.last[0]!, car.last[1]!];
    const steps = penaltySteps(rules, status);
    const crashed = status === "crashed" ? row[columns.length + 3]! : -1;
    const crashes = (car.crashes.get(crashed) ?? 0) + 1;
    const hasMercy = rules.mercy_after > 0 && crashed >= 0 && crashes >= rules.mercy_after;
    if (crashed >= 0) car.crashes.set(crashed, hasMercy ? 0 : crashes);
    const place = {
      distance: previous[at["projection_distance"]!]!,
      offset: previous[at["offset"]!]!,
      things: this.things(previous),
    };
    let pose = avoidingPose(road, place, crashed, hasMercy);
    if (carsPerRace > 1) pose = clearPose(road, pose, this.around(car, row));
    cars.setPose(car.index, pose.x, pose.y, pose.heading);
    cars.freeze(car.index, steps);
    car.resetsLeft -= 1;
    car.resets += 1;
    car.penalty += steps * CONTROL_DT;
  }

  private things(row: Float64Array): Thing[] {
    const things: Thing[] = [];
    for (let from = this.course.columns.length + HEADER; from < row.length; from += THING) {
      const [kind, x, y, , , offset, distance] = row.subarray(from, from + THING);
      things.push({ isGone: kind === GONE, x: x!, y: y!, offset: offset!, distance: distance! });
    }
    return things;
  }

  /** Middles of all that is around a car now. */
  private around(car: Judged, row: Float64Array): Point[] {
    const { cars, carsPerRace, numObjects } = this.course;
    const first = car.index - (car.index % carsPerRace);
    const { vehicles, count } = cars;
    const others = this.judged.slice(first, first + carsPerRace).filter((one) => one !== car && !one.status);
    return [
      ...this.things(row)
        .slice(0, numObjects)
        .map(({ x, y }): Point => [x, y]),
      ...others.map(({ index }): Point => [vehicles[index]!, vehicles[count + index]!]),
    ];
  }

  private startAgain(car: Judged, clock: number): void {
    const { core, cars, road, rules, seed } = this.course;
    const mask = new Uint8Array(cars.count);
    mask[car.index] = 1;
    cars.reset(mask);
    if (rules.starts === "line" && car.index > 0) {
      const start = { seed, trial: car.index, lap: car.laps.length, offset: this.startOffset(car.index) };
      const { x, y, heading } = startPose(core, road, rules, start);
      cars.setPose(car.index, x, y, heading);
    }
    [car.began, car.lapsBefore, car.resetsLeft] = [clock, car.laps.length, rules.max_resets];
    this.logStart(car);
  }

  /** The prepare step, at the pose that the car was given since. */
  private logStart(car: Judged): void {
    const { cars, road, rules, carsPerRace } = this.course;
    const { at } = this;
    const row = cars.rows.slice(car.index * cars.rowWidth, (car.index + 1) * cars.rowWidth);
    row[at["lap"]!] = car.lapsBefore;
    if (rules.starts === SEEDED || carsPerRace > 1) {
      car.start = row[at["projection_distance"]!]! - row[at["progress"]!]! * road.length;
      return this.take(car, row);
    }
    car.start = startDistance(road, rules);
    const [x, y, heading] = [0, 1, 2].map((field) => cars.vehicles[field * cars.count + car.index]!);
    row[at["x"]!] = x! + REFERENCE_AHEAD * Math.cos(heading!);
    row[at["y"]!] = y! + REFERENCE_AHEAD * Math.sin(heading!);
    row[at["heading"]!] = heading!;
    const [distance, offset] = road.project(row[at["x"]!]!, row[at["y"]!]!);
    [row[at["projection_distance"]!], row[at["offset"]!]] = [distance, offset];
    row[at["progress"]!] = this.progress(car, distance, 0);
    this.take(car, row);
  }

  private startOffset(trial: number): number {
    const { cars, numObjects } = this.course;
    return numObjects ? cars.rows[trial * cars.rowWidth + this.at["offset"]!]! : 0;
  }

  private finishLap(car: Judged, row: Float64Array, clock: number): void {
    const before = car.laps.at(-1);
    const began = before ? before.start_time + before.time : 0;
    const status = this.course.statuses[row[this.at["status"]!]!]!;
    car.laps.push({
      number: car.laps.length + 1,
      status,
      start_time: began,
      time: clock - began,
      completion: status === "lap_complete" ? 1 : Math.min(Math.max(row[this.at["progress"]!]!, 0), 1),
      off_track_count: car.mistakes["off_track"] ?? 0,
      crash_count: car.mistakes["crashed"] ?? 0,
      immobilized_count: car.mistakes["immobilized"] ?? 0,
      reversed_count: car.mistakes["reversed"] ?? 0,
      resets: car.resets,
      penalty_seconds: car.penalty,
    });
    [car.mistakes, car.resets, car.penalty] = [{}, 0, 0];
  }

  private end(car: Judged, row: Float64Array, clock: number): void {
    this.finishLap(car, row, clock);
    car.status = car.laps.at(-1)!.status;
  }

  /** Fraction of the lap at a distance along the track; of a closed track's many, that near another. */
  private progress(car: Judged, distance: number, near: number): number {
    const { road } = this.course;
    const fraction = (distance - car.start) / road.length;
    return road.isClosed ? fraction - roundHalfEven(fraction - near) : fraction;
  }
}

const penaltySteps = (rules: Rules, status: string): number => {
  if (status === "crashed") return roundHalfEven(rules.collision_penalty / CONTROL_DT);
  if (status === "immobilized") return roundHalfEven(rules.immobilized_penalty / CONTROL_DT);
  return roundHalfEven(rules.offtrack_penalty / CONTROL_DT);
};

/** What each race draws from, by its number alone, as racecraft.race.placement: one a car. */
async function keysOf(seed: bigint, races: number[]): Promise<BigUint64Array> {
  const keys = await Promise.all(
    [...new Set(races)].map(async (race) => {
      const digest = await crypto.subtle.digest("SHA-256", new TextEncoder().encode(`${seed}/${race}`));
      return new DataView(digest).getBigUint64(0, true);
    }),
  );
  return BigUint64Array.from(races, (race) => keys[race]!);
}
