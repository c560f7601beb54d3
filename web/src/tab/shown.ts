/** A car that has learned already, to be looked at until somebody asks for more: a starter of the installed program. */
import type { Cars, Core, Learner } from "./core";
import { arraysOf, read, type Plan, type TrackFile } from "./plan";

const MOST = 2 ** 31 - 1; // steps and laps of a drive

export class ShownCar {
  readonly cars: Cars;
  readonly columns: string[];
  steps = 0;
  private readonly learner: Learner;
  private readonly table: Float64Array;

  constructor(core: Core, plan: Plan, track: TrackFile, weights: Float32Array) {
    const { trials, policies } = plan.races["time-trial"];
    const road = core.track(arraysOf(track));
    const laps = track.told.isClosed ? 1_000_000 : 1;
    this.cars = road.cars({ ...trials, num_envs: 1, laps, max_steps: MOST }, plan.vehicle);
    road.free();
    this.cars.reset();
    this.columns = core.names("row");
    this.learner = core.learner(policies.continuous.network);
    this.learner.write("weights", weights);
    this.table = Float64Array.from(plan.starter.table);
  }

  /** 1/15 s; a road's end, or a mistake, begins it anew. */
  step(): void {
    const { cars } = this;
    cars.step(this.learner.best(cars, this.table));
    this.steps++;
    if (cars.terminated[0] || cars.truncated[0]) cars.reset();
  }

  free(): void {
    this.cars.free();
    this.learner.free();
  }
}

/** The starter's weights: numbers of 16 bits in the file, which not every browser has an array for. */
export async function shownWeights(site: string): Promise<Float32Array> {
  const halves = new Uint16Array(await (await read(site, "data/starter.bin")).arrayBuffer());
  return Float32Array.from(halves, valueOfHalf);
}

/** IEEE 754's binary16, of which the file holds no infinities. */
export function valueOfHalf(half: number): number {
  const [sign, exponent, fraction] = [half >> 15 ? -1 : 1, (half >> 10) & 31, half & 1023];
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
}
