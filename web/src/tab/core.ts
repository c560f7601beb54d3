// The native core in a tab, as objects: cars on a track, a network, and PPO's loop over both. The other side is
// native/wasm/interface.cpp, where shapes and units are said.
import { type Address, CoreModule } from "./module";
import { type Helper, loadTeam } from "./team";

/** A track as `racecraft.sim.simulation.native_track` gives it, both directions. */
export interface TrackArrays {
  lines: Float64Array; // (6, count, 2) m: centre, inner and outer, then the reversed twin's
  count: number;
  tables: Float32Array; // (4, samples): widths and curvatures, then the twin's
  waypoints: Int32Array; // (2, count - 1)
  samplesPerMetre: number;
  isClosed: boolean;
}

/** What is around the cars, and what differs from episode to episode; nothing by default. */
export interface Around {
  objects?: { settings: Settings; places: [number, number][] }; // fraction of a lap and lane, of fixed ones
  ranges?: number[]; // as racecraft.sim.Randomization.values()
}

/** Numbers by name: every one that the core names, and no other. */
export type Settings = Record<string, number>;

export interface NetworkSettings {
  numbers: Settings;
  convs: number[][]; // filters, kernel, stride
  dense: number[];
  criticUnits: number[];
  lidarUnits: number[];
}

export interface Episode {
  total: number;
  length: number;
}

const LISTS = { cars: 0, ppo: 1, network: 2, vehicle: 3, row: 4, state: 5, objects: 6 } as const;
const PARTS = { weights: 0, moment1: 1, moment2: 2 } as const;
const MOST_EPISODES = 4096;

export interface LoadedCore {
  core: Core;
  threads: number;
  /** Whether the learner works without this machine's multiply-add, right but many times slower. */
  isSlow: boolean;
}

type Read = (file: string) => Promise<BufferSource>; // of the site

/** The fast build where its sums keep every bit, else the exact one, or without SIMD the scalar one. With helpers to
 * open, and so many threads, the fast build over shared memory where it runs. */
export async function loadCore(read: Read, threads = 1, open?: () => Helper): Promise<LoadedCore> {
  const team = threads > 1 && open ? await teamOf(read, threads, open) : undefined;
  if (team) return { core: team, threads, isSlow: false };
  for (const file of ["core.wasm", "exact.wasm", "scalar.wasm"]) {
    const code = await read(file);
    if (!WebAssembly.validate(code)) continue;
    const core = await Core.load(code);
    if (core.isFused) return { core, threads: 1, isSlow: file !== "core.wasm" };
  }
  throw new Error("This browser runs no build of the core.");
}

async function teamOf(read: Read, threads: number, open: () => Helper): Promise<Core | undefined> {
  try {
    const code = await read("threads.wasm");
    const core = new Core(await loadTeam(code, threads, open));
    return core.isFused ? core : undefined;
  } catch {
    return undefined; // a browser that refuses shared memory, or that much of it, has one thread
  }
}

export class Core {
  constructor(readonly module: CoreModule) {}

  static async load(code: BufferSource): Promise<Core> {
    return new Core(await CoreModule.load(code));
  }

  get isFused(): boolean {
    return this.module.call("is_fused") !== 0;
  }

  names(list: keyof typeof LISTS): string[] {
    return this.module.names(LISTS[list]);
  }

  track(track: TrackArrays): Track {
    const { lines, count, tables, waypoints, samplesPerMetre, isClosed } = track;
    const sizes: [string, number, number][] = [
      ["lines", lines.length, 12 * count],
      ["tables", tables.length % 4, 0],
      ["waypoints", waypoints.length, 2 * (count - 1)],
    ];
    for (const [name, size, expected] of sizes) {
      if (size !== expected) throw new Error(`The track's ${name} have a wrong size.`);
    }
    const at = this.module.with([lines, tables, waypoints], (atLines, atTables, atWaypoints) =>
      this.module.call(
        "make_track",
        ...[atLines, count, atTables, tables.length / 4, atWaypoints, samplesPerMetre],
        isClosed ? 1 : 0,
      ),
    );
    return new Track(this, at);
  }

  learner(network: NetworkSettings): Learner {
    const settings = [
      ...this.ordered("network", network.numbers),
      ...[network.convs.length, ...network.convs.flat()],
      ...[network.dense.length, ...network.dense],
      ...[network.criticUnits.length, ...network.criticUnits],
      ...[network.lidarUnits.length, ...network.lidarUnits],
    ];
    const at = this.module.with([Float64Array.from(settings)], (from) => this.module.call("make_learner", from));
    return new Learner(this, at);
  }

  /** Matrices that an untrained network begins with; layers are rows, columns and gain. */
  orthogonalWeights(seed: number, layers: number[][]): Float32Array {
    const size = layers.reduce((sum, [rows = 0, columns = 0]) => sum + rows * columns, 0);
    return this.module.with([Float64Array.from(layers.flat()), new Float32Array(size)], (from, to) => {
      this.module.call("orthogonal_weights", seed, from, layers.length, to);
      return this.module.view(Float32Array, to, size).slice();
    });
  }

  /** numpy.random.default_rng(seeds).random(count). */
  uniforms(seeds: bigint[], count: number): Float64Array {
    return this.module.with([BigUint64Array.from(seeds), new Float64Array(count)], (from, to) => {
      this.module.call("uniforms", from, seeds.length, to, count);
      return this.module.view(Float64Array, to, count).slice();
    });
  }

  /** Settings as the core takes them; an Error where a name is missing or unknown. */
  ordered(list: keyof typeof LISTS, settings: Settings): Float64Array {
    const names = this.names(list);
    const wrong = [
      ...names.filter((name) => !Number.isFinite(settings[name])),
      ...Object.keys(settings).filter((name) => !names.includes(name)),
    ];
    if (wrong.length) throw new Error(`These settings of ${list} are missing or unknown: ${wrong.join(", ")}.`);
    return Float64Array.from(names, (name) => settings[name] ?? 0);
  }
}

class Held {
  constructor(
    readonly core: Core,
    readonly at: Address,
  ) {}

  protected call(name: string, ...args: number[]): number {
    return this.core.module.call(name, this.at, ...args);
  }
}

export class Track extends Held {
  cars(settings: Settings, vehicle: Settings, { objects, ranges }: Around = {}): Cars {
    const { core } = this;
    const { module } = core;
    const arrays = [core.ordered("cars", settings), Float32Array.from(core.ordered("vehicle", vehicle))];
    if (objects) arrays.push(Float64Array.of(...core.ordered("objects", objects.settings), ...objects.places.flat()));
    if (ranges) arrays.push(Float32Array.from(ranges));
    const at = module.with(arrays, (atSettings, atVehicle, ...rest) =>
      module.call("make_cars", this.at, atSettings, atVehicle, objects ? rest[0]! : 0, ranges ? rest.at(-1)! : 0),
    );
    return new Cars(core, at);
  }

  free(): void {
    this.call("free_track");
  }
}

export class Cars extends Held {
  readonly count = this.call("num_envs");
  readonly numPixels = this.call("num_pixels");
  readonly rowWidth = this.call("row_width");
  readonly stateWidth = this.call("state_width");

  /** Steering angle in rad and speed in m/s, (N, 2). */
  step(actions: Float32Array): void {
    if (actions.length !== 2 * this.count) throw new Error(`${this.count} cars take as many pairs of commands.`);
    this.core.module.with([actions], (at) => this.call("step_cars", at));
  }

  /** With `seeds`, one a car and the same for all cars of a race, what is drawn begins anew. */
  reset(mask?: Uint8Array, seeds?: BigUint64Array): void {
    const everyone = new Uint8Array(this.count).fill(1);
    this.core.module.with([mask ?? everyone, seeds ?? new BigUint64Array()], (at, atSeeds) =>
      this.call("reset_cars", at, seeds ? atSeeds : 0),
    );
  }

  setPose(car: number, x: number, y: number, heading: number, speed = 0): void {
    this.call("set_pose", car, x, y, heading, speed);
  }

  freeze(car: number, steps: number): void {
    this.call("freeze_car", car, steps);
  }

  /** Everything that the next step depends on, as the installed program's Simulation.save() has it. */
  save(): Uint8Array {
    const size = this.call("save_cars", 0, 0);
    return this.core.module.with([new Uint8Array(size)], (to) => {
      this.call("save_cars", to, size);
      return this.core.module.view(Uint8Array, to, size).slice();
    });
  }

  // Views of what is now: good until the next call.
  get rows(): Float64Array {
    return this.core.module.view(Float64Array, this.call("rows_of"), this.count * this.rowWidth);
  }
  get state(): Float32Array {
    return this.core.module.view(Float32Array, this.call("state_of"), this.count * this.stateWidth);
  }
  get frames(): Uint8Array {
    return this.core.module.view(Uint8Array, this.call("frames_of"), this.count * this.numPixels);
  }
  get vehicles(): Float32Array {
    return this.core.module.view(Float32Array, this.call("vehicles_of"), 7 * this.count);
  }
  get terminated(): Uint8Array {
    return this.core.module.view(Uint8Array, this.call("terminated_of"), this.count);
  }
  get truncated(): Uint8Array {
    return this.core.module.view(Uint8Array, this.call("truncated_of"), this.count);
  }

  free(): void {
    this.call("free_cars");
  }
}

export class Learner extends Held {
  readonly numParameters = this.call("num_parameters");

  read(part: keyof typeof PARTS): Float32Array {
    return this.core.module.with([new Float32Array(this.numParameters)], (to) => {
      this.call("read_part", PARTS[part], to);
      return this.core.module.view(Float32Array, to, this.numParameters).slice();
    });
  }

  write(part: keyof typeof PARTS, values: Float32Array): void {
    if (values.length !== this.numParameters) throw new Error("These weights are of another network.");
    this.core.module.with([values], (from) => this.call("write_part", PARTS[part], from));
  }

  get numUpdates(): number {
    return this.call("num_updates");
  }
  set numUpdates(count: number) {
    this.call("set_num_updates", count);
  }

  /** What the policy likes best for each car, as commands (N, 2). `table` as for a training. */
  best(cars: Cars, table: Float64Array): Float32Array {
    return this.core.module.with([table, new Float32Array(2 * cars.count)], (from, to) => {
      this.call("choose_best", cars.at, from, to);
      return this.core.module.view(Float32Array, to, 2 * cars.count).slice();
    });
  }

  /** PPO's loop; `table` are commands (A, 2), or the lowest and the highest of continuous actions (2, 2). */
  train(cars: Cars, settings: Settings, table: Float64Array): Training {
    const at = this.core.module.with([this.core.ordered("ppo", settings), table], (atSettings, atTable) =>
      this.core.module.call("make_training", this.at, cars.at, atSettings, atTable),
    );
    return new Training(this.core, at);
  }

  free(): void {
    this.call("free_learner");
  }
}

export class Training extends Held {
  begin(seed: number, iteration: number, totalSteps: number): void {
    this.call("begin_iteration", seed, iteration, totalSteps);
  }

  /** One step of all cars; false where the policy's outputs are not finite, and nothing moved. */
  drive(): boolean {
    return this.call("drive") !== 0;
  }

  /** Pays that step; true where the rollout is full. */
  pay(rewards: Float64Array): boolean {
    return this.core.module.with([rewards], (at) => this.call("pay", at)) !== 0;
  }

  /** False where loss or gradient is not finite; that step was not taken. */
  learn(): boolean {
    return this.call("learn") !== 0;
  }

  get totalSteps(): number {
    return this.call("total_steps");
  }

  /** The episodes under way: sums of their rewards, and their steps; mean and spread of the returns. */
  underWay(numCars: number): { totals: Float64Array; lengths: BigInt64Array; returnScale: Float64Array } {
    const { module } = this.core;
    return {
      totals: module.view(Float64Array, this.call("episode_totals"), numCars).slice(),
      lengths: module.view(BigInt64Array, this.call("episode_lengths"), numCars).slice(),
      returnScale: module.view(Float64Array, this.call("return_scale"), 2).slice(),
    };
  }

  /** Episodes that ended since begin(). */
  ended(): Episode[] {
    return this.core.module.with([new Float64Array(2 * MOST_EPISODES)], (to) => {
      const count = Math.min(this.call("ended_episodes", to, MOST_EPISODES), MOST_EPISODES);
      const numbers = this.core.module.view(Float64Array, to, 2 * count);
      return Array.from({ length: count }, (_, i) => ({
        total: numbers[2 * i] ?? NaN,
        length: numbers[2 * i + 1] ?? 0,
      }));
    });
  }

  free(): void {
    this.call("free_training");
  }
}
