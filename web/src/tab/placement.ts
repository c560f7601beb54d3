/** Where cars are put, at the start and after a mistake: racecraft.race.placement, operation by operation. */
import type { Core } from "./core";
import type { Rules } from "./verify/header";
import { wrapAngle, type Point, type Road } from "./road";

export interface Pose {
  x: number; // m
  y: number; // m
  heading: number; // rad
}

/** An object of a judged row. */
export interface Thing {
  isGone: boolean;
  x: number;
  y: number;
  offset: number;
  distance: number;
}

/** What puts a car back on the track, as racecraft.race.rules. */
export const RESET_STATUSES = ["crashed", "off_track", "immobilized", "reversed"];

const CLEARANCE = 1; // m between an object and a car that is put back
const LEAST_ROOM = 0.6; // m to the next object in a lane
const ROOM = 0.5; // m from the middle of a car that is put back to any other's
const [SEARCH_STEP, SEARCHED] = [0.25, 40]; // m from place to place that is tried, and how many

export const startDistance = (road: Road, rules: Rules): number =>
  road.isClosed ? rules.start_offset * road.length : 0;

/** Where a trial starts from the line: exactly for trial 0, else off by the rules' jitter. */
export function startPose(
  core: Core,
  road: Road,
  rules: Rules,
  { seed, trial, lap, offset }: { seed: bigint; trial: number; lap: number; offset: number },
): Pose {
  const s = startDistance(road, rules);
  const heading = road.headingAt(s);
  let [x, y] = road.pointAt(s);
  [x, y] = [x - offset * Math.sin(heading), y + offset * Math.cos(heading)];
  if (trial === 0) return { x, y, heading };
  const [across, turn] = core.uniforms([seed, BigInt(trial), BigInt(lap)], 2).map((share) => -1 + 2 * share);
  const left = rules.lateral_jitter * across!;
  const turned = wrapAngle(heading + rules.heading_jitter * turn!);
  return { x: x - left * Math.sin(heading), y: y + left * Math.cos(heading), heading: turned };
}

/** In the lane that the car was nearest to, along the track. */
export function resetPose(road: Road, distance: number, offset: number): Pose {
  const [x, y] = road.laneAt(distance, offset >= 0);
  return { x, y, heading: road.headingAt(distance) };
}

/** The same, but not where an object is near: behind it in the other lane, or with mercy past it. */
export function avoidingPose(
  road: Road,
  { distance, offset, things }: { distance: number; offset: number; things: Thing[] },
  crashed: number,
  hasMercy: boolean,
): Pose {
  const there = things.filter((one) => !one.isGone);
  if (!there.length) return resetPose(road, distance, offset);
  if (crashed >= 0 && there.length < things.length)
    crashed = things.slice(0, crashed).filter((one) => !one.isGone).length;
  const away = there.map((one) => Math.abs(road.ahead(one.distance, distance)));
  const nearest = crashed >= 0 ? crashed : away.indexOf(Math.min(...away));
  if (crashed < 0 && away[nearest]! >= CLEARANCE) return resetPose(road, distance, offset);
  const near = there[nearest]!;
  const s = road.onTrack(near.distance + (hasMercy ? CLEARANCE : -CLEARANCE));
  const room = (side: number) =>
    Math.min(
      CLEARANCE,
      ...there.filter((one) => Math.sign(one.offset) === side).map((one) => Math.abs(road.ahead(one.distance, s))),
    );
  const other = near.offset > 0 ? -1 : 1;
  return resetPose(road, s, room(other) >= room(-other) || room(other) > LEAST_ROOM ? other : -other);
}

/** A place where nobody is: the given one, or the nearest behind it, in either lane. */
export function clearPose(road: Road, pose: Pose, others: Point[]): Pose {
  const hasRoom = ({ x, y }: Pose) => others.every((one) => Math.hypot(one[0] - x, one[1] - y) >= ROOM);
  if (hasRoom(pose)) return pose;
  const [s, offset] = road.project(pose.x, pose.y);
  for (let number = 1; number <= SEARCHED; number++) {
    const behind = road.onTrack(s - number * SEARCH_STEP);
    for (const side of [offset, -offset]) {
      const found = resetPose(road, behind, side);
      if (hasRoom(found)) return found;
    }
  }
  return pose;
}
