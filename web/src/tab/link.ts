/** A link that carries a reward and a track behind its #, so that no server sees them. What a link brings is shown, and
 * runs when somebody who has seen it says so. */

export interface Gift {
  source: string;
  track: string;
}

const MOST_LETTERS = 16_000; // of a link, which messengers and browsers still take whole
const MOST_BYTES = 140_000; // of a source, the most that AWS accepts
const [SOURCE, TRACK] = ["reward", "track"];

/** The address of a page with a gift; undefined where it would be too long. */
export async function linkTo(page: string, { source, track }: Gift): Promise<string | undefined> {
  const packed = await through(new TextEncoder().encode(source), new CompressionStream("deflate-raw"), Infinity);
  const letters = btoa(String.fromCharCode(...packed.subarray(0, MOST_LETTERS)));
  if (packed.length > MOST_LETTERS || letters.length > MOST_LETTERS) return undefined;
  const link = new URL(page);
  link.hash = new URLSearchParams({ [TRACK]: track, [SOURCE]: urlSafe(letters) }).toString();
  return link.href;
}

/** Whether an address is meant to bring something, be it damaged or not. */
export const isGift = (address: string): boolean => new RegExp(`^#(.*&)?${SOURCE}=`).test(new URL(address).hash);

/** What an address brings; undefined where that is nothing, or nothing that makes sense. */
export async function giftOf(address: string): Promise<Gift | undefined> {
  const hash = new URL(address).hash.slice(1);
  if (!hash || hash.length > 2 * MOST_LETTERS) return undefined;
  const found = new URLSearchParams(hash);
  const [letters, track] = [found.get(SOURCE), found.get(TRACK)];
  if (!letters || !track) return undefined;
  try {
    const packed = Uint8Array.from(atob(letters.replaceAll("-", "+").replaceAll("_", "/")), (one) => one.charCodeAt(0));
    const bytes = await through(packed, new DecompressionStream("deflate-raw"), MOST_BYTES);
    return { source: new TextDecoder("utf-8", { fatal: true }).decode(bytes), track };
  } catch {
    return undefined;
  }
}

const urlSafe = (letters: string) => letters.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");

/** Bytes after a transformation; an Error as soon as there are more than `most`. */
async function through(
  bytes: Uint8Array,
  change: CompressionStream | DecompressionStream,
  most: number,
): Promise<Uint8Array> {
  const reader = new Blob([bytes as Uint8Array<ArrayBuffer>]).stream().pipeThrough(change).getReader();
  const parts: number[] = [];
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return Uint8Array.from(parts);
    if (parts.length + value.length > most) {
      await reader.cancel();
      throw new Error("A link brings more than a reward function.");
    }
    for (const byte of value) parts.push(byte);
  }
}
