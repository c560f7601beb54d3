/** A replay file's bytes, as docs/replay-file.md describes them: every size is bounded before anything is read. */
import type { ReplayLimits } from "../plan";
import { headerOf, WIDTHS, type CarHeader, type ColumnType, type Header } from "./header";
import { ReplayProblem } from "./problem";

const MAGIC = "RACECRAFTREPLAY\0";
const VERSION = 2; // 1, which knows no race, is read as well
const PREFIX = 16 + 4 + 8 + 32; // bytes: magic, version, size of the body, its SHA-256

export interface StoredCar extends CarHeader {
  actions: Float32Array; // (T, 2) rad, m/s
  rewards: Float64Array; // (T,)
  rows: Float64Array[]; // T of them, `time` included
}

export interface ReplayFile extends Omit<Header, "cars"> {
  lines: Float64Array; // (6, W) m: x and y of centre line, inner and outer border
  cars: StoredCar[];
}

const damaged = (): never => {
  throw new ReplayProblem("replay_damaged");
};

/** A ReplayProblem that says how large a replay may be. */
export const tooLarge = ({ file, cells }: ReplayLimits): ReplayProblem =>
  new ReplayProblem("replay_large", { size: file >> 20, cells: cells / 1e6 });

/** What a file holds; a ReplayProblem where it is damaged, hostile or of another version.
 *
 * `columns` are names of a row's own; with objects there are more. */
export async function readReplay(
  file: Uint8Array<ArrayBuffer>,
  columns: string[],
  limits: ReplayLimits,
): Promise<ReplayFile> {
  if (file.length > limits.file) throw tooLarge(limits);
  const begins = new TextDecoder("latin1").decode(file.subarray(0, MAGIC.length));
  if (file.length < PREFIX || begins !== MAGIC) throw new ReplayProblem("replay_not");
  const prefix = new DataView(file.buffer, file.byteOffset, PREFIX);
  const version = prefix.getUint32(16, true);
  if (version < 1 || version > VERSION) throw new ReplayProblem("replay_version", { version });
  const size = Number(prefix.getBigUint64(20, true));
  if (size < 4) damaged();
  if (size > Math.min(limits.body, limits.dense + limits.density * file.length)) throw tooLarge(limits);
  const body = await inflated(file.subarray(PREFIX), size);
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", body));
  if (digest.some((byte, at) => byte !== file[28 + at])) damaged();
  const length = new DataView(body.buffer).getUint32(0, true);
  if (length > Math.min(limits.header, size - 4)) damaged();
  let text: string;
  try {
    text = new TextDecoder("utf-8", { fatal: true }).decode(body.subarray(4, 4 + length));
  } catch {
    return damaged();
  }
  return contentOf(headerOf(text), body.subarray(4 + length), columns, limits);
}

/** Exactly `size` bytes out of zlib's; never more are kept than that. */
async function inflated(packed: Uint8Array<ArrayBuffer>, size: number): Promise<Uint8Array<ArrayBuffer>> {
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  const body = new Uint8Array(size);
  let filled = 0;
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return filled === size ? body : damaged();
      if (filled + value.length > size) {
        await reader.cancel();
        return damaged();
      }
      body.set(value, filled);
      filled += value.length;
    }
  } catch (error) {
    if (error instanceof ReplayProblem) throw error;
    return damaged(); // the browser's own words about it differ
  }
}

function contentOf(header: Header, body: Uint8Array, columns: string[], limits: ReplayLimits): ReplayFile {
  const { track, cars, cars_per_race, objects } = header;
  const around = (objects.obstacles?.count ?? 0) + (objects.bots?.count ?? 0) + cars_per_race - 1;
  const width = columns.length + (around ? 4 + 7 * around : 0);
  if (cars.length % cars_per_race) damaged();
  if (cars.reduce((sum, { steps }) => sum + steps, 0) * width > limits.cells) throw tooLarge(limits);
  let at = 0;
  const column = (length: number, type: ColumnType): Float64Array => {
    const bytes = body.subarray(at, (at += length * WIDTHS[type]));
    return bytes.length === length * WIDTHS[type] ? unpacked(type, bytes, limits.number) : damaged();
  };
  const lines = new Float64Array(6 * track.waypoints);
  track.types.forEach((type, index) => lines.set(column(track.waypoints, type), index * track.waypoints));
  const stored = cars.map((car): StoredCar => {
    if (car.types.length !== 2 + width) damaged(); // the reward takes the place of the time
    const next = (place: number) => column(car.steps, car.types[place]!);
    const actions = new Float32Array(2 * car.steps);
    for (const place of [0, 1]) next(place).forEach((value, step) => (actions[2 * step + place] = value));
    const rewards = next(2);
    const rows = Array.from({ length: car.steps }, () => new Float64Array(width));
    const [time, steps] = [columns.indexOf("time"), columns.indexOf("steps")];
    // a column at a time: all of them would be as large as the rows
    for (const [place, index] of [...Array(width).keys()].filter((index) => index !== time).entries())
      next(3 + place).forEach((value, step) => (rows[step]![index] = value));
    for (const row of rows) row[time] = row[steps]! * (1 / 15); // as the core counts it
    return { ...car, actions, rewards, rows };
  });
  return at === body.length ? { ...header, lines, cars: stored } : damaged();
}

const VIEWS = { u1: Uint8Array, i2: Int16Array, i4: Int32Array, f4: Float32Array, f8: Float64Array } as const;

/** Bytes sorted by significance, each value combined by exclusive or with the one before. */
function unpacked(type: ColumnType, sorted: Uint8Array, most: number): Float64Array {
  const width = WIDTHS[type];
  const length = sorted.length / width;
  const bytes = new Uint8Array(sorted.length); // little-endian, as every machine that runs this
  for (let byte = 0; byte < width; byte++)
    for (let index = 0, before = 0; index < length; index++)
      bytes[index * width + byte] = before ^= sorted[byte * length + index]!;
  const values = Float64Array.from(new VIEWS[type](bytes.buffer));
  for (const value of values) if (!(Math.abs(value) <= most)) damaged();
  return values;
}
