/** A replay's cars driven again from their stored actions, whatever comes out. */
import type { Cars, Core, Settings } from "../core";
import { countOf, toldObjects } from "../objects";
import { arraysOf, type Plan, type TrackFile } from "../plan";
import { Road } from "../road";
import type { ReplayFile } from "./file";
import { Marshal, type Course, type Driven } from "./marshal";
import { ReplayProblem } from "./problem";

const SMALLEST_CAMERA = 8; // pixels: only where the camera looks is part of the rules
const MOST_STEPS_TO_A_LAP = 100_000;
const PALETTES = ["2018", "2020", "2026"];
const [FIXED, RANDOM] = [0, 2]; // starts of the simulation

export interface Watching {
  /** Is told every row of a car, in their order. */ log: (car: number, row: Float64Array, cars: Cars) => void;
  /** Whether enough was seen. */ isOver: () => boolean;
  /** Whether the cars see what the driver saw, instead of next to nothing. */ hasPictures?: boolean;
}

export async function driveAgain(
  core: Core,
  plan: Plan,
  replay: ReplayFile,
  file: TrackFile,
  { log, isOver, hasPictures = false }: Watching,
): Promise<Driven[]> {
  const { rules, vehicle, objects, randomize, seed, cars: stored } = replay;
  const none = plan.known.randomize["none"]!;
  const isRandom = Object.entries(randomize).some(([name, [low, high]]) => {
    const range = none[name];
    if (!range) throw new ReplayProblem("replay_header", { at: "header.randomize" });
    return low !== range[0] || high !== range[1];
  });
  const ranges = isRandom ? Object.keys(none).flatMap((name) => randomize[name] ?? none[name]!) : undefined;
  const around = { objects: toldObjects(objects), ranges };
  const settings = settingsOf(plan, replay, file.told.isClosed, hasPictures);
  const cars = core.track(arraysOf(file)).cars(settings, vehicle, around);
  const course: Course = {
    ...{ core, cars, rules, seed, columns: core.names("row"), statuses: plan.statuses, numObjects: countOf(objects) },
    ...{ road: new Road(file, rules.direction === "reverse"), carsPerRace: replay.cars_per_race },
  };
  const steps = stored.map(() => 0);
  const marshal = await Marshal.begin(course, isRandom, (car, row) => {
    steps[car]!++;
    log(car, row, cars);
  });
  const actions = new Float32Array(2 * stored.length);
  while (!isOver() && marshal.isRacing) {
    actions.fill(0);
    stored.forEach((car, index) => {
      const step = steps[index]!;
      if (step < car.steps) actions.set(car.actions.subarray(2 * step, 2 * step + 2), 2 * index);
    });
    marshal.step(actions);
  }
  return marshal.results();
}

function settingsOf(
  plan: Plan,
  { rules, seed, camera, cars, cars_per_race }: ReplayFile,
  isClosed: boolean,
  hasPictures: boolean,
): Settings {
  const isAlone = cars_per_race === 1;
  const fromLine = rules.starts === "line";
  const laps = rules.is_continuous && isClosed ? rules.laps : 1; // of one simulated episode
  const told: Settings = {
    ...plan.races["time-trial"].trials,
    num_envs: cars.length,
    cars_per_race,
    seed: Number(seed & 0xffff_ffffn),
    seed_high: Number(seed >> 32n),
    laps,
    max_steps: laps * MOST_STEPS_TO_A_LAP,
    start_mode: fromLine ? FIXED : RANDOM,
    start_offset: fromLine ? rules.start_offset : 0,
    start_spread: 0,
    lateral_jitter: !fromLine && isAlone ? rules.lateral_jitter : 0,
    heading_jitter: !fromLine && isAlone ? rules.heading_jitter : 0,
    direction: rules.direction === "reverse" ? 1 : 0,
    has_camera: Number(camera !== null),
    palette: 0,
    picture_age: 0,
    baseline: 0,
  };
  if (!camera) return told;
  return {
    ...told,
    width: hasPictures ? camera.width : SMALLEST_CAMERA,
    height: hasPictures ? camera.height : SMALLEST_CAMERA,
    hfov: camera.horizontal_fov,
    forward: camera.forward,
    left: camera.left,
    above: camera.above_ground,
    pitch: camera.pitch,
    baseline: camera.baseline,
    palette: PALETTES.indexOf(camera.palette),
    picture_age: Math.round((camera.age / (1 / 15)) * plan.races["time-trial"].trials["substeps"]!),
  };
}
