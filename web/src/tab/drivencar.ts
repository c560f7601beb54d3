/** One car on one track, driven by hand: what racecraft.serve.driving.drives does on the console's server. */
import type { Drive, DriveState, Settings } from "../api/drives";
import type { Cars, Core } from "./core";
import { resetPose, RESET_STATUSES } from "./placement";
import { arraysOf, type Plan, type TrackFile } from "./plan";
import { Road } from "./road";

export type Trace = [number, number, number][]; // x, y, heading of every step in mm and mrad

const CONTROL_DT = 1 / 15; // s
const PENALTY = 1; // s that a car stands after leaving the track
const LONGEST_TRACE = 15 * 300; // steps of a lap that are remembered
const MOST = 2 ** 31 - 1; // steps of a drive
const FIELDS = [0, 1, 2, 3, 6]; // x, y, heading, speed, steering of what moves

const milli = (value: number) => Math.round(1000 * value);

export class DrivenCar {
  private readonly car: Cars;
  private readonly road: Road;
  private readonly columns: string[];
  private began = 0; // s, when the present lap did
  private lap = 1;
  private mistakes = 0;
  private standing = 0; // steps left of a penalty
  private before: Float64Array; // the row a step ago
  private trace: Trace = [];

  constructor(
    core: Core,
    private readonly plan: Plan,
    private readonly track: TrackFile,
    private readonly settings: Settings,
  ) {
    const { vehicle, direction } = settings;
    const isReversed = direction === "reverse";
    const { cars } = plan.races["time-trial"];
    const told = {
      ...{ ...cars, num_envs: 1, has_camera: 0, picture_age: 0, start_mode: 0, start_offset: 0, start_spread: 0 },
      ...{ start_advance: 0, lateral_jitter: 0, heading_jitter: 0, direction: Number(isReversed), max_steps: MOST },
      laps: track.told.isClosed ? 1_000_000 : 1,
    };
    const road = core.track(arraysOf(track));
    this.car = road.cars(told, plan.known.vehicle[vehicle]!);
    road.free();
    this.car.reset();
    this.road = new Road(track, isReversed);
    this.columns = core.names("row");
    this.before = this.car.rows.slice();
  }

  begin(id: string): Drive {
    const { geometry } = this.track;
    return { id, geometry, direction: this.settings.direction, start: this.pose, best: null, medals: null };
  }

  free(): void {
    this.car.free();
  }

  /** x, y, heading, speed, steering in mm and mrad; share of the lap in 1/1000. */
  private get pose(): number[] {
    const { vehicles } = this.car;
    return [...FIELDS.map((field) => vehicles[field]!), this.of(this.car.rows, "progress")].map(milli);
  }

  private of(row: Float64Array, name: string): number {
    return row[this.columns.indexOf(name)]!;
  }

  /** Drive on; and when a lap was completed, its trace. */
  step(steering: number, speed: number, steps: number): { state: DriveState; trace: Trace } {
    const { car } = this;
    let [mistake, finished, trace]: [string, DriveState["finished"], Trace] = ["", null, []];
    for (let step = 0; step < steps; step++) {
      car.step(Float32Array.of(steering, speed));
      const row = car.rows.slice();
      const status = this.plan.statuses[this.of(row, "status")]!;
      this.standing = Math.max(0, this.standing - 1);
      if (this.trace.length < LONGEST_TRACE) this.trace.push(this.pose.slice(0, 3) as Trace[number]);
      if (status === "lap_complete") {
        trace = this.trace.length < LONGEST_TRACE ? this.trace : [];
        finished = this.finish(this.of(row, "time"));
        break; // a lap to an answer
      }
      if (RESET_STATUSES.includes(status)) {
        this.putBack(status);
        mistake = status === "immobilized" ? "" : status;
      }
      this.before = row;
    }
    const clock = finished ? 0 : Math.max(0, this.of(car.rows, "time") - this.began);
    const { lap, mistakes, standing, pose } = this;
    return { state: { pose, clock, lap, standing: standing * CONTROL_DT, mistake, mistakes, finished }, trace };
  }

  private finish(now: number): NonNullable<DriveState["finished"]> {
    const seconds = Math.round(1e4 * (now - this.began)) / 1e4;
    const lap = { number: this.lap, seconds, mistakes: this.mistakes, is_best: false };
    [this.lap, this.mistakes, this.trace, this.began] = [this.lap + 1, 0, [], now];
    if (!this.road.isClosed) {
      this.car.reset(); // an open road begins anew
      this.began = 0;
    }
    this.before = this.car.rows.slice();
    return lap;
  }

  /** A driver who waits is left alone; one who left the road stands where they left it. */
  private putBack(status: string): void {
    const { car, before } = this;
    if (status === "immobilized") return car.setPose(0, ...(car.vehicles.slice(0, 3) as unknown as Place));
    this.mistakes++;
    this.standing = Math.round(PENALTY / CONTROL_DT);
    const { x, y, heading } = resetPose(this.road, this.of(before, "projection_distance"), this.of(before, "offset"));
    car.setPose(0, x, y, heading);
    car.freeze(0, this.standing);
  }
}

type Place = [number, number, number];
