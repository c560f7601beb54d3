/** How far to stand back so that everything is in the picture. */
type Vector = readonly [number, number, number];

const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

const AIR = 1.06; // times as much as is needed, so that nothing touches the edge

/**
 * Distance of a camera that looks at the origin and sees all points.
 *
 * @param points What is to be seen, relative to what is looked at.
 * @param back Where the camera is, a unit vector; `right` and `up` are the camera's own.
 * @param tangent Of half the upright angle of view.
 */
export function standBack(
  points: Vector[],
  { back, right, up }: { back: Vector; right: Vector; up: Vector },
  tangent: number,
  aspect: number,
): number {
  let far = 0;
  for (const point of points) {
    const near = dot(point, back); // so much nearer than the origin
    const wide = Math.abs(dot(point, right)) / (tangent * aspect);
    const high = Math.abs(dot(point, up)) / tangent;
    far = Math.max(far, near + AIR * Math.max(wide, high));
  }
  return far;
}
