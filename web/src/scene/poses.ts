/** Cars between two looks: they drive on smoothly, and jump when they were put at a new start. */
export interface Look {
  step: number;
  poses: number[][]; // x, y, heading, speed, steering in mm and mrad, share of the lap in 1/1000
  steps: number[];
  /** Around the car whose picture is shown: kind, x, y, heading in mm and mrad. */
  objects?: [string, number, number, number][];
  policy: number[];
  is_discrete: boolean;
  focus?: number; // the car to follow; else the one that is furthest
  tints?: number[]; // colour of each car; else by how far it is
}

/** What a car sees: a byte of grey a pixel, in base64. */
export interface Picture {
  frame: string;
  frame_shape: [number, number];
}

export interface Pose {
  x: number;
  y: number;
  heading: number;
  speed: number;
  progress: number;
}

const FARTHEST = 3; // m that a car may drive between two looks; more is a jump

const pose = (row: number[]): Pose => ({
  x: row[0]! / 1000,
  y: row[1]! / 1000,
  heading: row[2]! / 1000,
  speed: row[3]! / 1000,
  progress: row[5]! / 1000,
});

/** A look with its cars where they were at a share of the way to it: whence they go on when the next look comes early. */
export function halfway(before: Look | undefined, now: Look, share: number): Look {
  const poses = between(before, now, share).map(({ x, y, heading }, car) => [
    x * 1000,
    y * 1000,
    heading * 1000,
    ...now.poses[car]!.slice(3),
  ]);
  return { ...now, poses };
}

/** Difference of two angles, −π to π. */
export const turn = (from: number, to: number): number => Math.atan2(Math.sin(to - from), Math.cos(to - from));

/** Where every car is at a share (0 to 1) of the way from one look to the next. */
export function between(before: Look | undefined, now: Look, share: number): Pose[] {
  return now.poses.map((row, car) => {
    const to = pose(row);
    const from = before?.poses[car] && pose(before.poses[car]!);
    const isNew = !from || now.steps[car]! < before!.steps[car]! || Math.hypot(to.x - from.x, to.y - from.y) > FARTHEST;
    if (isNew) return to;
    return {
      x: from.x + (to.x - from.x) * share,
      y: from.y + (to.y - from.y) * share,
      heading: from.heading + turn(from.heading, to.heading) * share,
      speed: to.speed,
      progress: to.progress,
    };
  });
}
