/** A road as the page has those of the library: everything that racecraft.site.plan.track_file says of one, computed here. */
import { Road, wrapAngle } from "../road";
import { curvatureOf } from "../laps/bends";
import { sha256 } from "../model";
import { momentsOf, type Words } from "../moments";
import type { TrackFile } from "../plan";

import { arcOf, isRing, pointsOf, turned } from "./line";
import type { Lines } from "./road";

const TABLE_SPACING = 0.05; // m

type Packed = TrackFile["told"]["lines"];

function packed(dtype: Packed["dtype"], values: Float64Array | Float32Array | Int32Array): Packed {
  const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
  let text = "";
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return { dtype, data: btoa(text) };
}

function joined<T extends Float64Array | Float32Array>(parts: T[]): T {
  const all = new (parts[0]!.constructor as new (size: number) => T)(
    parts.reduce((sum, { length }) => sum + length, 0),
  );
  parts.reduce((at, part) => (all.set(part as never, at), at + part.length), 0);
  return all;
}

/** Whether the inner border lies left of the driving direction, as racecraft.track.Track. */
function isInnerLeft({ center, inner, outer }: Lines): boolean {
  const last = pointsOf(center) - 1;
  let sum = 0;
  for (let at = 0; at <= last; at++) {
    const [from, to] = [Math.max(at - 1, 0), Math.min(at + 1, last)];
    const slope = (axis: number) => (center[2 * to + axis]! - center[2 * from + axis]!) / (to - from);
    const across = (axis: number) => inner[2 * at + axis]! - outer[2 * at + axis]!;
    sum += slope(0) * across(1) - slope(1) * across(0);
  }
  return sum >= 0;
}

/** SHA-256 of the geometry, hexadecimal. */
async function digestOf({ center, inner, outer }: Lines): Promise<string> {
  const rows = Float64Array.from({ length: 3 * center.length }, (_, at) => {
    const [row, column] = [Math.floor(at / 6), at % 6];
    return [center, inner, outer][column >> 1]![2 * row + (column % 2)]!;
  });
  return sha256(new Uint8Array(rows.buffer)); // little-endian, as every machine that runs this
}

export async function fileOf(name: string, lines: Lines, words: Words): Promise<TrackFile> {
  const file = shapeOf(name, lines);
  return { ...file, digest: await digestOf(lines), situations: momentsOf(file, words) };
}

/** The same without what takes longer: to be drawn and judged. */
export function shapeOf(name: string, lines: Lines): TrackFile {
  const twin = { center: turned(lines.center), inner: turned(lines.inner), outer: turned(lines.outer) };
  const sides = [lines, twin];
  const isClosed = isRing(lines.center);
  const count = pointsOf(lines.center);
  const pieces = Int32Array.from({ length: count - 1 }, (_, piece) => piece);
  const arcs = sides.map(({ center }) => arcOf(center));
  const headings = sides.map(({ center }) =>
    Float64Array.from(pieces, (at) =>
      wrapAngle(Math.atan2(center[2 * at + 3]! - center[2 * at + 1]!, center[2 * at + 2]! - center[2 * at]!)),
    ),
  );
  const points = (line: Float64Array) =>
    Array.from({ length: count - Number(isClosed) }, (_, at) =>
      [line[2 * at]!, line[2 * at + 1]!].map((value) => Math.round(value * 1e4) / 1e4),
    );
  const { center, inner, outer } = lines;
  const length = arcs[0]!.at(-1)!;
  const both = new Int32Array(2 * (count - 1));
  both.set(pieces);
  both.set(pieces, count - 1);
  const file: TrackFile = {
    told: {
      lines: packed("float64", joined(sides.flatMap((side) => [side.center, side.inner, side.outer]))),
      tables: packed("float32", new Float32Array()),
      waypoints: packed("int32", both),
      ...{ count, samplesPerMetre: 0, isClosed },
    },
    waypoints: sides.map((side) =>
      Array.from(pieces, (_, at) => at)
        .concat(count - 1)
        .map((at): [number, number] => [side.center[2 * at]!, side.center[2 * at + 1]!]),
    ),
    road: {
      arcs: packed("float64", joined(arcs)),
      headings: packed("float64", joined(headings)),
      innerIsLeft: sides.map(isInnerLeft),
      repeats: [],
    },
    geometry: { name, length, is_closed: isClosed, center: points(center), inner: points(inner), outer: points(outer) },
    ...{ digest: "", situations: [] },
  };
  const [road, back] = [new Road(file, false), new Road(file, true)];
  const samples = Math.max(2, Math.ceil(length / TABLE_SPACING));
  const steps = isClosed ? samples : samples - 1;
  const places = Array.from({ length: samples }, (_, at) => at * (length / steps));
  const widths = Float32Array.from(places, (s) => road.widthAt(s));
  const around = isClosed ? [widths[0]!, ...Array.from(widths.slice(1)).reverse()] : Array.from(widths).reverse();
  const [bends, other] = [road, back].map((side) => Float32Array.from(places, curvatureOf(side)));
  file.told.tables = packed("float32", joined([widths, bends!, Float32Array.from(around), other!]));
  file.told.samplesPerMetre = steps / length;
  return file;
}
