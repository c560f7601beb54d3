/** Files of arrays by name, https://huggingface.co/docs/safetensors, as racecraft.run.tensor_file writes them. */
const TYPES = { Float64Array: "F64", BigInt64Array: "I64", Float32Array: "F32", Uint8Array: "U8" };
type Data = Float64Array | BigInt64Array | Float32Array | Uint8Array;

export interface Tensor {
  data: Data;
  shape: number[];
}

export function tensorFile(arrays: Record<string, Tensor>, metadata: Record<string, string>): Uint8Array<ArrayBuffer> {
  // wide types first, so that every array begins aligned
  const order = Object.entries(arrays).sort(([, a], [, b]) => b.data.BYTES_PER_ELEMENT - a.data.BYTES_PER_ELEMENT);
  const header: Record<string, unknown> = { __metadata__: metadata };
  let end = 0;
  for (const [name, { data, shape }] of order) {
    const begin = end;
    end += data.byteLength;
    const dtype = TYPES[data.constructor.name as keyof typeof TYPES];
    header[name] = { dtype, shape, data_offsets: [begin, end] };
  }
  const head = new TextEncoder().encode(JSON.stringify(header));
  const padded = Math.ceil(head.length / 8) * 8;
  const all = new Uint8Array(8 + padded + end).fill(0x20, 8, 8 + padded);
  new DataView(all.buffer).setBigUint64(0, BigInt(padded), true);
  all.set(head, 8);
  let at = 8 + padded;
  for (const [, { data }] of order) {
    all.set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength), at);
    at += data.byteLength;
  }
  return all;
}

const MOST_HEADER = 1 << 20; // bytes
const MOST_SIDES = 8; // of a shape

/** A stranger's file, of which nothing is believed: its texts, and arrays by name as they are asked for. */
export class TensorReader {
  readonly texts: Record<string, unknown>;
  private readonly arrays: Record<string, unknown>;
  private readonly body: Uint8Array<ArrayBuffer>;

  /** An Error where it is no such file. */
  constructor(file: Uint8Array<ArrayBuffer>) {
    const length =
      file.length < 8 ? Infinity : Number(new DataView(file.buffer, file.byteOffset).getBigUint64(0, true));
    if (length > Math.min(MOST_HEADER, file.length - 8)) throw new Error("The file has no header.");
    const head = new TextDecoder("utf-8", { fatal: true }).decode(file.subarray(8, 8 + length));
    this.arrays = record(JSON.parse(head));
    this.texts = record(own(this.arrays, "__metadata__") ?? {});
    this.body = file.subarray(8 + length);
  }

  /** A float32 array of a shape; an Error where there is none, or a number of it is not finite. */
  floats(name: string, shape: number[]): Float32Array {
    const { dtype, shape: sides, data_offsets: ends } = record(own(this.arrays, name)) as Record<string, unknown>;
    const size = shape.reduce((all, side) => all * side, 4);
    const isAsked =
      dtype === "F32" && Array.isArray(sides) && sides.length <= MOST_SIDES && sides.join() === shape.join();
    const [begin, end] = Array.isArray(ends) && ends.every(Number.isSafeInteger) ? (ends as number[]) : [-1, -1];
    if (!isAsked || begin! < 0 || end! - begin! !== size || end! > this.body.length)
      throw new Error(`${name} is not what it should be.`);
    const found = new Float32Array(this.body.slice(begin, end).buffer);
    if (!found.every(Number.isFinite)) throw new Error(`${name} holds what is no number.`);
    return found;
  }
}

const own = (of: Record<string, unknown>, name: string) => (Object.hasOwn(of, name) ? of[name] : undefined);

function record(value: unknown): Record<string, unknown> {
  if (typeof value !== "object" || value === null || Array.isArray(value))
    throw new Error("This is no table of names.");
  return value as Record<string, unknown>;
}
