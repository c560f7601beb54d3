/** Files in one: POSIX ustar, https://pubs.opengroup.org/onlinepubs/9699919799/utilities/pax.html */

const BLOCK = 512; // bytes

export function tar(files: Record<string, Uint8Array>, seconds: number): Uint8Array {
  const parts = Object.entries(files).flatMap(([name, data]) => [
    header(name, data.length, Math.floor(seconds)),
    data,
    new Uint8Array((BLOCK - (data.length % BLOCK)) % BLOCK),
  ]);
  parts.push(new Uint8Array(2 * BLOCK));
  const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

function header(name: string, size: number, seconds: number): Uint8Array {
  const block = new Uint8Array(BLOCK);
  const put = (at: number, text: string) => block.set(new TextEncoder().encode(text), at);
  const octal = (value: number, digits: number) => `${value.toString(8).padStart(digits, "0")}\0`;
  put(0, name);
  put(100, octal(0o644, 7) + octal(0, 7) + octal(0, 7) + octal(size, 11) + octal(seconds, 11));
  put(148, " ".repeat(8)); // the checksum counts itself as blanks
  put(156, "0");
  put(257, "ustar\x0000");
  const sum = block.reduce((total, byte) => total + byte, 0);
  put(148, `${sum.toString(8).padStart(6, "0")}\0 `);
  return block;
}

export const gzip = (data: Uint8Array): Promise<Blob> =>
  new Response(new Blob([data as Uint8Array<ArrayBuffer>]).stream().pipeThrough(new CompressionStream("gzip"))).blob();
