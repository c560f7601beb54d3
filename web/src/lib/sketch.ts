/** A road drawn by control points: the same centripetal cubic spline that the server draws, and what one does to points. */
export interface ControlPoint {
  x: number;
  y: number;
  width: number;
}
export interface Sketch {
  points: ControlPoint[];
  is_closed: boolean;
}
export interface Road {
  center: number[][];
  left: number[][];
  right: number[][];
  length: number;
  pieces: number[];
}

const STEP = 0.12; // m between samples

/** Solve a small dense system for two columns at once; the matrix is diagonally dominant, so no pivoting. */
function solve(matrix: number[][], rhs: [number, number][]): [number, number][] {
  const size = rhs.length;
  for (let i = 0; i < size; i++) {
    for (let j = i + 1; j < size; j++) {
      const share = matrix[j]![i]! / matrix[i]![i]!;
      if (share === 0) continue;
      for (let k = i; k < size; k++) matrix[j]![k]! -= share * matrix[i]![k]!;
      rhs[j]![0] -= share * rhs[i]![0];
      rhs[j]![1] -= share * rhs[i]![1];
    }
  }
  for (let i = size - 1; i >= 0; i--) {
    for (let k = i + 1; k < size; k++) {
      rhs[i]![0] -= matrix[i]![k]! * rhs[k]![0];
      rhs[i]![1] -= matrix[i]![k]! * rhs[k]![1];
    }
    rhs[i]![0] /= matrix[i]![i]!;
    rhs[i]![1] /= matrix[i]![i]!;
  }
  return rhs;
}

/** Second derivatives at the nodes. */
export function bends(points: [number, number][], steps: number[], isClosed: boolean): [number, number][] {
  const slopes = steps.map((step, i) => [
    (points[i + 1]![0] - points[i]![0]) / step,
    (points[i + 1]![1] - points[i]![1]) / step,
  ]);
  const first = isClosed ? 0 : 1;
  const size = isClosed ? steps.length : points.length - 2;
  const matrix = Array.from({ length: size }, () => new Array<number>(size).fill(0));
  const rhs: [number, number][] = [];
  for (let row = 0; row < size; row++) {
    const node = row + first;
    const [into, out] = [(node - 1 + steps.length) % steps.length, node % steps.length];
    matrix[row]![row]! += 2 * (steps[into]! + steps[out]!);
    if (isClosed || row > 0) matrix[row]![(row - 1 + size) % size]! += steps[into]!;
    if (isClosed || row + 1 < size) matrix[row]![(row + 1) % size]! += steps[out]!;
    rhs.push([6 * (slopes[out]![0]! - slopes[into]![0]!), 6 * (slopes[out]![1]! - slopes[into]![1]!)]);
  }
  const found = solve(matrix, rhs);
  return isClosed ? [...found, found[0]!] : [[0, 0], ...found, [0, 0]];
}

/** The road of a sketch, or undefined while there is none: too few points, or two on one place. */
export function draw({ points, is_closed: isClosed }: Sketch): Road | undefined {
  if (points.length < 3) return undefined;
  const ring = isClosed ? [...points, points[0]!] : points;
  const places = ring.map((point): [number, number] => [point.x, point.y]);
  const steps = places.slice(1).map((to, i) => Math.sqrt(Math.hypot(to[0] - places[i]![0], to[1] - places[i]![1])));
  if (steps.some((step) => !(step > 0.05))) return undefined;
  const curved = bends(places, steps, isClosed);
  const road: Road = { center: [], left: [], right: [], length: 0, pieces: [] };
  steps.forEach((step, piece) => {
    const [from, to, a, b] = [places[piece]!, places[piece + 1]!, curved[piece]!, curved[piece + 1]!];
    const count = Math.max(2, Math.ceil((step * step) / STEP));
    const last = !isClosed && piece === steps.length - 1 ? count : count - 1;
    for (let sample = 0; sample <= last; sample++) {
      const after = (step * sample) / count;
      const before = step - after;
      const at = (axis: 0 | 1) =>
        (a[axis] * before ** 3 + b[axis] * after ** 3) / (6 * step) +
        (from[axis] / step - (a[axis] * step) / 6) * before +
        (to[axis] / step - (b[axis] * step) / 6) * after;
      const along = (axis: 0 | 1) =>
        (b[axis] * after ** 2 - a[axis] * before ** 2) / (2 * step) +
        (to[axis] - from[axis]) / step -
        ((b[axis] - a[axis]) * step) / 6;
      const [x, y, dx, dy] = [at(0), at(1), along(0), along(1)];
      const half = (ring[piece]!.width + (ring[piece + 1]!.width - ring[piece]!.width) * (sample / count)) / 2;
      const norm = Math.hypot(dx, dy) || 1;
      const previous = road.center.at(-1);
      if (previous) road.length += Math.hypot(x - previous[0]!, y - previous[1]!);
      road.center.push([x, y]);
      road.left.push([x - (dy / norm) * half, y + (dx / norm) * half]);
      road.right.push([x + (dy / norm) * half, y - (dx / norm) * half]);
      road.pieces.push(piece);
    }
  });
  if (isClosed)
    road.length += Math.hypot(
      road.center[0]![0]! - road.center.at(-1)![0]!,
      road.center[0]![1]! - road.center.at(-1)![1]!,
    );
  return road;
}

const round = (value: number, to = 0.01) => Math.round(value / to) * to;

/** Points rounded to a centimetre, as the table shows them. */
export const tidy = (point: ControlPoint): ControlPoint => ({
  x: +round(point.x).toFixed(2),
  y: +round(point.y).toFixed(2),
  width: +round(point.width).toFixed(2),
});

export const middle = (points: ControlPoint[]): [number, number] => {
  const [xs, ys] = [points.map((point) => point.x), points.map((point) => point.y)];
  return [(Math.min(...xs) + Math.max(...xs)) / 2, (Math.min(...ys) + Math.max(...ys)) / 2];
};

/** Seen in a mirror, along the x axis; the driving direction along the road stays. */
export function mirror(points: ControlPoint[]): ControlPoint[] {
  const [x] = middle(points);
  return points.map((point) => tidy({ ...point, x: 2 * x - point.x }));
}

/** Driven the other way, from the same start. */
export const reverse = ({ points, is_closed: isClosed }: Sketch): ControlPoint[] =>
  isClosed ? [points[0]!, ...points.slice(1).reverse()] : [...points].reverse();

export function turn(points: ControlPoint[], angle: number): ControlPoint[] {
  const [x, y] = middle(points);
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return points.map((point) =>
    tidy({
      ...point,
      x: x + (point.x - x) * cos - (point.y - y) * sin,
      y: y + (point.x - x) * sin + (point.y - y) * cos,
    }),
  );
}

/** Larger or smaller; the road keeps its width. */
export function resize(points: ControlPoint[], factor: number): ControlPoint[] {
  const [x, y] = middle(points);
  return points.map((point) => tidy({ ...point, x: x + (point.x - x) * factor, y: y + (point.y - y) * factor }));
}

/** A line drawn in one go as few control points: about one to every `spacing` metres, more where it bends. */
export function simplify(line: number[][], width: number, tolerance = 0.12): ControlPoint[] {
  const keep = new Set([0, line.length - 1]);
  const split = (from: number, to: number): void => {
    const [a, b] = [line[from]!, line[to]!];
    const span = Math.hypot(b[0]! - a[0]!, b[1]! - a[1]!) || 1e-9;
    let [far, worst] = [-1, tolerance];
    for (let index = from + 1; index < to; index++) {
      const point = line[index]!;
      const away = Math.abs((b[0]! - a[0]!) * (point[1]! - a[1]!) - (b[1]! - a[1]!) * (point[0]! - a[0]!)) / span;
      const direct = Math.hypot(point[0]! - a[0]!, point[1]! - a[1]!);
      const distance = span < 1e-6 ? direct : away;
      if (distance > worst) [far, worst] = [index, distance];
    }
    if (far < 0) return;
    keep.add(far);
    split(from, far);
    split(far, to);
  };
  if (line.length > 2) {
    const half = Math.floor(line.length / 2);
    keep.add(half);
    split(0, half);
    split(half, line.length - 1);
  }
  const kept = [...keep].sort((a, b) => a - b).map((index) => line[index]!);
  const found: ControlPoint[] = [];
  for (const [x, y] of kept as [number, number][]) {
    const last = found.at(-1);
    if (!last || Math.hypot(last.x - x, last.y - y) > 0.45) found.push(tidy({ x, y, width }));
  }
  return found;
}

/** A circuit to begin with. */
export const oval = (width = 0.9): ControlPoint[] =>
  [
    [0, -2.2],
    [3.4, -2.2],
    [5.2, 0],
    [3.4, 2.2],
    [0, 1.7],
    [-3.4, 2.2],
    [-5.2, 0],
    [-3.4, -2.2],
  ].map(([x, y]) => ({ x: x!, y: y!, width }));
