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
