/** Where lines meet: pieces sorted into squares of a grid, so that long roads are judged at once, too. */
import { pointsOf, type Line } from "./line";

const SQUARE = 0.5; // m

type Piece = [number, number, number, number];
const pieceOf = (line: Line, at: number) => line.subarray(2 * at, 2 * at + 4) as unknown as Piece;

/** The first place of a line that touches another, or itself where they are the same; joints within one do not count. */
export function meeting(first: Line, second: Line): [number, number] | undefined {
  const squares = new Map<string, number[]>();
  const eachSquare = (piece: Piece, use: (key: string) => void) => {
    const [x0, y0, x1, y1] = piece.map((value) => Math.floor(value / SQUARE)) as unknown as Piece;
    for (let x = Math.min(x0, x1); x <= Math.max(x0, x1); x++)
      for (let y = Math.min(y0, y1); y <= Math.max(y0, y1); y++) use(`${x},${y}`);
  };
  const whole = (line: Line, at: number) => Array.from(pieceOf(line, at)) as Piece;
  for (let at = 0; at + 1 < pointsOf(second); at++)
    eachSquare(whole(second, at), (key) => squares.set(key, [...(squares.get(key) ?? []), at]));
  const last = pointsOf(first) - 2;
  for (let at = 0; at <= last; at++) {
    let isMet = false;
    const piece = whole(first, at);
    eachSquare(piece, (key) => {
      for (const other of squares.get(key) ?? []) {
        const apart = Math.abs(at - other);
        if (first === second && (apart <= 1 || apart >= last)) continue;
        isMet ||= crosses(piece, whole(second, other));
      }
    });
    if (isMet) return [piece[0], piece[1]];
  }
  return undefined;
}

/** Whether two pieces share a point. */
function crosses([ax, ay, bx, by]: Piece, [cx, cy, dx, dy]: Piece): boolean {
  const side = (x0: number, y0: number, x1: number, y1: number, x: number, y: number) =>
    Math.sign((x1 - x0) * (y - y0) - (y1 - y0) * (x - x0));
  const [a, b] = [side(cx, cy, dx, dy, ax, ay), side(cx, cy, dx, dy, bx, by)];
  const [c, d] = [side(ax, ay, bx, by, cx, cy), side(ax, ay, bx, by, dx, dy)];
  if (a !== b && c !== d) return true;
  const within = (p: number, q: number, value: number) => Math.min(p, q) <= value && value <= Math.max(p, q);
  const on = (s: number, p: Piece, x: number, y: number) => s === 0 && within(p[0], p[2], x) && within(p[1], p[3], y);
  const [one, two]: [Piece, Piece] = [
    [ax, ay, bx, by],
    [cx, cy, dx, dy],
  ];
  return on(a, two, ax, ay) || on(b, two, bx, by) || on(c, one, cx, cy) || on(d, one, dx, dy);
}

/** Whether a ring has a point inside. */
export function isInside(ring: Line, x: number, y: number): boolean {
  let isIn = false;
  for (let at = 0; at + 3 < ring.length; at += 2) {
    const [x0, y0, x1, y1] = [ring[at]!, ring[at + 1]!, ring[at + 2]!, ring[at + 3]!];
    if (y0 > y !== y1 > y && x < ((x1 - x0) * (y - y0)) / (y1 - y0) + x0) isIn = !isIn;
  }
  return isIn;
}
