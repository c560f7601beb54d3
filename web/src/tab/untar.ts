/** The files of a stranger's tar.gz that somebody asks for. It is read as a stream, nothing of it is kept but those, and
 * every size is bounded before anything is taken. Names are keys and lead nowhere; links and devices are passed over. */
import { ArrivalProblem } from "./arrivalproblem";

const BLOCK = 512; // bytes
const MOST_FILE = 256 << 20; // bytes, packed
const MOST_UNPACKED = 1 << 30;
const MOST_MEMBERS = 20_000;
const MOST_HEADER = 1 << 16; // bytes of a long name
const MOST_KEPT = 128 << 20; // bytes, all together
const REGULAR = ["0", "\0", "7"];

const damaged = (): never => {
  throw new ArrivalProblem("arrive_damaged");
};

/** `mostOf`: how many bytes a file of a name may have, 0 where it is not wanted; a longer one is passed over. */
export async function untar(
  file: Blob,
  mostOf: (name: string) => number,
): Promise<Map<string, Uint8Array<ArrayBuffer>>> {
  if (file.size > MOST_FILE) throw new ArrivalProblem("arrive_large", { size: MOST_FILE >> 20 });
  const stream = new Bytes(file.stream().pipeThrough(new DecompressionStream("gzip")).getReader());
  try {
    return await membersOf(stream, mostOf);
  } finally {
    await stream.close();
  }
}

async function membersOf(stream: Bytes, mostOf: (name: string) => number) {
  const found = new Map<string, Uint8Array<ArrayBuffer>>();
  let [longName, kept] = ["", 0];
  for (let members = 0; members < MOST_MEMBERS; members++) {
    const header = await stream.take(BLOCK);
    if (header.every((byte) => byte === 0)) return found;
    const { name, kind, size } = headerOf(header, members === 0);
    const padding = (BLOCK - (size % BLOCK)) % BLOCK;
    if (kind === "x" || kind === "L") {
      if (size > MOST_HEADER) damaged();
      const said = text(await stream.take(size));
      longName = kind === "L" ? said.split("\0")[0]! : pathOf(said);
      await stream.skip(padding);
      continue;
    }
    const whole = (longName || name).replace(/^(\.\/)+/, "");
    longName = "";
    const most = REGULAR.includes(kind) ? mostOf(whole) : 0;
    if (most > 0 && size <= most) {
      kept += size;
      if (found.has(whole) || kept > MOST_KEPT) damaged();
      found.set(whole, await stream.take(size));
    } else await stream.skip(size);
    await stream.skip(padding);
  }
  return damaged();
}

function headerOf(block: Uint8Array, isFirst: boolean): { name: string; kind: string; size: number } {
  const field = (from: number, length: number) => text(block.subarray(from, from + length)).split("\0")[0]!;
  const octal = (from: number, length: number) => {
    const digits = field(from, length).trim();
    return /^[0-7]{1,11}$/.test(digits) ? parseInt(digits, 8) : damaged();
  };
  const sum = block.reduce((total, byte, at) => total + (at >= 148 && at < 156 ? 32 : byte), 0);
  if (field(257, 5) !== "ustar" || octal(148, 8) !== sum) {
    if (isFirst) throw new ArrivalProblem("arrive_not");
    damaged();
  }
  const [prefix, name] = [block[262] === 0 ? field(345, 155) : "", field(0, 100)];
  return {
    name: prefix ? `${prefix}/${name}` : name,
    kind: String.fromCharCode(block[156]!),
    size: octal(124, 12),
  };
}

/** The path of a pax header, of lines such as "27 path=somewhere/far\n". */
function pathOf(said: string): string {
  const lines = said.split("\n").map((line) => /^\d+ (\w[\w.]*)=(.*)$/s.exec(line));
  if (lines.some((line) => line?.[1] === "size")) damaged(); // of members larger than any that is wanted
  return lines.find((line) => line?.[1] === "path")?.[2] ?? "";
}

function text(bytes: Uint8Array): string {
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return damaged();
  }
}

/** Bytes that come in pieces, taken in others. */
class Bytes {
  private piece = new Uint8Array();
  private at = 0;
  private total = 0;

  constructor(private readonly reader: ReadableStreamDefaultReader<Uint8Array>) {}

  /** Exactly so many. */
  async take(count: number): Promise<Uint8Array<ArrayBuffer>> {
    const all = new Uint8Array(count);
    let filled = 0;
    await this.pass(count, (part) => {
      all.set(part, filled);
      filled += part.length;
    });
    return all;
  }

  skip(count: number): Promise<void> {
    return this.pass(count, () => {});
  }

  async close(): Promise<void> {
    await this.reader.cancel().catch(() => {}); // that it was damaged has been said
  }

  private async pass(count: number, use: (part: Uint8Array) => void): Promise<void> {
    for (let left = count; left > 0;) {
      if (this.at === this.piece.length) await this.more();
      const part = this.piece.subarray(this.at, this.at + left);
      use(part);
      this.at += part.length;
      left -= part.length;
    }
  }

  private async more(): Promise<void> {
    const { done, value } = await this.reader.read().catch(() => damaged()); // the browser's own words about it differ
    if (done) return damaged();
    this.total += value.length;
    if (this.total > MOST_UNPACKED) throw new ArrivalProblem("arrive_large", { size: MOST_FILE >> 20 });
    [this.piece, this.at] = [value as Uint8Array<ArrayBuffer>, 0];
  }
}
