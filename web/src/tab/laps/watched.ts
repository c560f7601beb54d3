/** Laps to be watched: of a model's evaluation, driven once more by its rules, or of a replay that is genuine. What the car
 * saw is drawn when somebody wants to see it, by driving as far again. */
import type { EvaluationLaps } from "../../lib/laps";
import type { Cars, Core } from "../core";
import { countOf, toldObjects } from "../objects";
import { arraysOf, type Plan, type TrackFile } from "../plan";
import { Road } from "../road";
import { driveAgain } from "../verify/again";
import type { ReplayFile } from "../verify/file";
import { Marshal, type Course } from "../verify/marshal";
import type { Judge } from "../worker";
import { lapsOf, reported, type DrivenLap } from "./laps";
import { toPay, type ToPay } from "./paid";

const RULES = "first_lap"; // of evaluations during a training

/** Is told every row of a car; true ends the drive. */
type Watch = (car: number, row: Float64Array, cars: Cars) => boolean;

export interface Eyes {
  frames: Uint8Array; // grey, one after the other
  shape: [number, number]; // height and width
}

export class Watched {
  private constructor(
    private readonly plan: Plan,
    private readonly columns: string[],
    private readonly laps: DrivenLap[],
    readonly report: EvaluationLaps,
    private readonly again: (watch: Watch) => Promise<[number, number] | undefined>, // and the shape of its pictures
  ) {}

  static async evaluation(core: Core, asked: Judge): Promise<Watched> {
    const { plan, track } = asked;
    const road = new Road(track, false);
    const cars: Float64Array[][] = [];
    const again = (watch: Watch) => evaluate(core, asked, road, watch);
    await again((car, row) => {
      (cars[car] ??= []).push(row);
      return false;
    });
    return Watched.of(core, plan, { road, track, cars, isReversed: false, again });
  }

  static of(
    core: Core,
    plan: Plan,
    about: {
      road: Road;
      track: TrackFile;
      cars: Float64Array[][];
      isReversed: boolean;
      again: (watch: Watch) => Promise<[number, number] | undefined>;
    },
  ): Watched {
    const { road, track, cars, isReversed, again } = about;
    const columns = core.names("row");
    const laps = lapsOf(road, cars, columns, plan);
    const report = reported(road, laps, track.geometry.name, isReversed);
    return new Watched(plan, columns, laps, report, again);
  }

  static replay(core: Core, plan: Plan, replay: ReplayFile, track: TrackFile): Watched {
    const isReversed = replay.rules.direction === "reverse";
    const { camera } = replay;
    const again = async (watch: Watch): Promise<[number, number] | undefined> => {
      if (!camera) return undefined;
      let isOver = false;
      const log = (car: number, row: Float64Array, cars: Cars) => void (isOver ||= watch(car, row, cars));
      await driveAgain(core, plan, replay, track, { log, isOver: () => isOver, hasPictures: true });
      return [camera.height, camera.width];
    };
    const cars = replay.cars.map(({ rows }) => rows);
    return Watched.of(core, plan, { road: new Road(track, isReversed), track, cars, isReversed, again });
  }

  /** What a reward is asked for these laps. */
  toPay(): ToPay[] {
    return this.laps.map((lap) => toPay(lap, this.columns, this.plan.statuses));
  }

  /** Take down what a reward paid for them; `isAfresh`: it remembers something, and began anew with these laps. */
  pay(rewards: (number | null)[][], isAfresh: boolean): void {
    rewards.forEach((paid, at) => (this.report.laps[at]!.reward = paid));
    this.report.reward.is_afresh = isAfresh;
  }

  /** What the car saw in every row of a lap. */
  async eyes(number: number): Promise<Eyes | undefined> {
    const found = this.laps.find(({ lap }) => lap.number === number);
    if (!found) return undefined;
    const { car, from, rows } = found;
    const seen: Uint8Array[] = [];
    let step = 0;
    const shape = await this.again((one, _, cars) => {
      if (one !== car) return false;
      if (step++ >= from) seen.push(cars.frames.slice(car * cars.numPixels, (car + 1) * cars.numPixels));
      return step >= from + rows.length;
    });
    if (!shape || !seen.length) return undefined;
    const frames = new Uint8Array(seen.length * seen[0]!.length);
    seen.forEach((frame, at) => frames.set(frame, at * frame.length));
    return { frames, shape };
  }
}

/** One evaluation of a training, car by car as `racecraft evaluate` drives it. */
async function evaluate(core: Core, asked: Judge, road: Road, watch: Watch): Promise<[number, number]> {
  const { plan, race, policy, objects, track, seed, begin } = asked;
  const told = toldObjects(objects);
  const made = core.track(arraysOf(track));
  const cars = made.cars({ ...race.trials, seed: 0 }, plan.vehicle, told ? { objects: told } : {});
  const learner = core.learner(policy.network);
  learner.write("weights", begin.weights);
  const course: Course = {
    ...{ core, cars, road, rules: plan.known.rules[RULES]!, carsPerRace: 1, numObjects: countOf(objects) },
    ...{ columns: core.names("row"), statuses: plan.statuses },
    seed: BigInt((seed + plan.evaluationSeed) % 2 ** 32),
  };
  const table = Float64Array.from(policy.table);
  const most = Math.round((15 * road.length) / plan.slowest); // steps of 1/15 s, after which a training does not wait
  let isOver = false;
  const marshal = await Marshal.begin(course, false, (car, row) => void (isOver ||= watch(car, row, cars)));
  for (let step = 0; step < most && marshal.isRacing && !isOver; step++) marshal.step(learner.best(cars, table));
  learner.free();
  cars.free();
  made.free();
  return [race.cars["height"]!, race.cars["width"]!];
}
