/** Whether a drawing can be driven, in the sentences of racecraft.track.sketch and validate: the first that is wrong. */
import type { SketchVerdict } from "../../api/tracks";
import type { Sketch } from "../../lib/sketch";
import { findCorners } from "../laps/corners";
import { curvatureOf } from "../laps/bends";
import { Road, wrapAngle } from "../road";
import { shapeOf } from "./file";
import { areaOf, arcOf, isRing, pointsOf, type Line } from "./line";
import { isInside, meeting } from "./meet";
import { roadOf, type Lines } from "./road";

const [MIN_POINTS, MAX_POINTS] = [3, 200];
const [NEAREST, FARTHEST, WIDEST] = [0.05, 500, 10]; // m
const [LONGEST, MIN_LENGTH, MIN_WIDTH] = [200, 1, 0.1]; // m
const MAX_TURN = (135 * Math.PI) / 180; // between two pieces of centre line
const SLANTED = 0.95; // of a row's length: a road narrower than that is not square to the row
const MAX_DETOUR = 1.5; // inner to centre to outer, over inner to outer

interface Trouble {
  message: string;
  hint?: string;
  place?: [number, number];
}

const near = ([x, y]: [number, number]) => ` near (${x.toFixed(2)}, ${y.toFixed(2)})`;

export function judge(sketch: Sketch): SketchVerdict {
  const wrong = sketchTrouble(sketch);
  if (wrong) return { ok: false, ...told(wrong), corners: 0, direction: "" };
  const lines = roadOf(sketch);
  const file = shapeOf("drawing", lines);
  const road = new Road(file, false);
  const curvature = curvatureOf(road);
  let tightest = 0;
  for (let s = 0; s < road.length; s += 0.05) tightest = Math.max(tightest, Math.abs(curvature(s)));
  const widths = Array.from(road.arc, (s, at) => {
    const [row, across] = [between(lines.inner, lines.outer, at), road.widthAt(s)];
    return across < SLANTED * row ? across : row;
  });
  const trouble = roadTrouble(lines);
  const isLeft = road.isClosed ? areaOf(lines.center) > 0 : file.road.innerIsLeft[0];
  return {
    ok: trouble === undefined,
    ...(trouble ? told(trouble) : {}),
    geometry: file.geometry,
    min_radius: tightest > 1e-9 ? 1 / tightest : null,
    mean_width: widths.reduce((sum, one) => sum + one, 0) / widths.length,
    corners: findCorners(road).length,
    direction: isLeft ? "counter-clockwise" : "clockwise",
  };
}

const told = ({ message, hint = "", place }: Trouble) => ({
  problem: { code: "track", message, hint } as SketchVerdict["problem"],
  place: place ?? null,
});

/** Of two lines' points in one row, m. */
const between = (a: Line, b: Line, at: number) => Math.hypot(a[2 * at]! - b[2 * at]!, a[2 * at + 1]! - b[2 * at + 1]!);

function sketchTrouble({ points, is_closed: isClosed }: Sketch): Trouble | undefined {
  const count = points.length;
  if (count < MIN_POINTS || count > MAX_POINTS)
    return { message: `A drawing has ${MIN_POINTS} to ${MAX_POINTS} points; this one has ${count}.` };
  for (const [at, { x, y, width }] of points.entries()) {
    if (![x, y].every((value) => Math.abs(value) <= FARTHEST))
      return { message: `Point ${at + 1} is (${x}, ${y}); points lie within ${FARTHEST} m of the origin.` };
    if (!(width >= MIN_WIDTH && width <= WIDEST))
      return {
        message: `The road is ${width} m wide at point ${at + 1}; allowed is ${MIN_WIDTH} to ${WIDEST} m.`,
      };
  }
  const ring = isClosed ? [...points, points[0]!] : points;
  const steps = ring.slice(1).map(({ x, y }, at) => Math.hypot(x - ring[at]!.x, y - ring[at]!.y));
  const least = steps.indexOf(Math.min(...steps));
  if (steps[least]! < NEAREST) {
    const { x, y } = points[least]!;
    const pair = `Points ${least + 1} and ${((least + 1) % count) + 1}`;
    return {
      message: `${pair} lie on one place, near (${x.toFixed(2)}, ${y.toFixed(2)}).`,
      hint: `Keep ${NEAREST} m between them, or take one away.`,
      place: [x, y],
    };
  }
  const length = steps.reduce((sum, one) => sum + one, 0);
  if (length > LONGEST)
    return { message: `The drawing is ${length.toFixed(0)} m long; allowed is at most ${LONGEST} m.` };
  return undefined;
}

function roadTrouble({ center, inner, outer }: Lines): Trouble | undefined {
  const isClosed = isRing(center);
  const length = arcOf(center).at(-1)!;
  if (length < MIN_LENGTH)
    return { message: `The road is ${+length.toPrecision(3)} m long; at least ${MIN_LENGTH} m are needed.` };
  return (
    turnTrouble(center, isClosed) ??
    widthTrouble({ center, inner, outer }) ??
    crossTrouble({ center, inner, outer }, isClosed)
  );
}

function turnTrouble(center: Line, isClosed: boolean): Trouble | undefined {
  const pieces = pointsOf(center) - 1;
  const step = (at: number, axis: number) => center[2 * at + 2 + axis]! - center[2 * at + axis]!;
  const steps = Array.from({ length: pieces }, (_, at) => Math.hypot(step(at, 0), step(at, 1)));
  const gap = Math.hypot(center.at(-2)! - center[0]!, center.at(-1)! - center[1]!);
  if (!isClosed && gap <= 2 * Math.max(...steps))
    return {
      message: `The road ends ${+gap.toPrecision(3)} m from where it begins, neither open nor closed.`,
      hint: "Repeat the first row as the last one to close it.",
    };
  const heading = Array.from({ length: pieces }, (_, at) => Math.atan2(step(at, 1), step(at, 0)));
  const turns = heading.map((angle, at) =>
    Math.abs(wrapAngle((heading[at + 1] ?? (isClosed ? heading[0]! : angle)) - angle)),
  );
  const sharpest = turns.indexOf(Math.max(...turns));
  if (!(turns[sharpest]! > MAX_TURN)) return undefined;
  const place: [number, number] = [center[2 * sharpest + 2]!, center[2 * sharpest + 3]!];
  const turn = ((turns[sharpest]! * 180) / Math.PI).toFixed(0);
  return {
    message: `The road turns by ${turn} degrees at one waypoint,${near(place)}; at most 135 are allowed.`,
    place,
  };
}

function widthTrouble({ center, inner, outer }: Lines): Trouble | undefined {
  for (let at = 0; at < pointsOf(center); at++) {
    const width = between(inner, outer, at);
    if (width < MIN_WIDTH)
      return {
        message: `The road is ${+width.toPrecision(3)} m wide at waypoint ${at}; at least ${MIN_WIDTH} m is allowed.`,
      };
    if (between(center, inner, at) + between(center, outer, at) > MAX_DETOUR * width)
      return { message: `The road: at waypoint ${at} the centre line is not between its borders.` };
  }
  return undefined;
}

function crossTrouble({ center, inner, outer }: Lines, isClosed: boolean): Trouble | undefined {
  const lines: [string, Line][] = [
    ["centre line", center],
    ["inner border", inner],
    ["outer border", outer],
  ];
  for (const [name, line] of lines) {
    const place = meeting(line, line);
    if (place) return { message: `The road: its ${name} crosses or touches itself${near(place)}.`, place };
  }
  for (const [first, second] of [
    [0, 1],
    [0, 2],
    [1, 2],
  ] as const) {
    const [[name, line], [otherName, other]] = [lines[first]!, lines[second]!];
    const place = meeting(line, other);
    if (place) return { message: `The road: its ${name} crosses its ${otherName}${near(place)}.`, place };
  }
  if (isClosed) {
    const [x, y] = [center[0]!, center[1]!];
    if (!isInside(outer, inner[0]!, inner[1]!) || !isInside(outer, x, y) || isInside(inner, x, y))
      return {
        message: `The road: its inner border does not lie inside its outer one, with the centre line between.`,
      };
  } else {
    const end = inner.length - 2;
    const cap = (at: number) => Float64Array.of(inner[at]!, inner[at + 1]!, outer[at]!, outer[at + 1]!);
    const inside = (line: Line) => line.subarray(2, -2);
    const [start, finish] = [cap(0), cap(end)];
    if (
      meeting(start, finish) ||
      [start, finish].some((one) => [inner, outer].some((line) => meeting(one, inside(line))))
    )
      return { message: `The road: its borders do not bound one stretch of road; its ends cross.` };
  }
  return undefined;
}
