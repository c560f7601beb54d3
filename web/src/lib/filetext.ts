/** The text of a file that somebody chose or dropped, as the command line reads one: nothing of it is ever replaced. */

/** What the first or second line of a Python file may say that it is, if not UTF-8; as the browser calls it. */
const CODINGS: Record<string, string> = {
  ...Object.fromEntries(["latin-1", "latin1", "iso-8859-1", "iso8859-1"].map((one) => [one, "latin1"])),
  ...Object.fromEntries(["latin-9", "latin9", "iso-8859-15", "iso8859-15"].map((one) => [one, "iso-8859-15"])),
  ...Object.fromEntries(["cp1252", "windows-1252"].map((one) => [one, "windows-1252"])),
};
const CODING = /^((?:[ \t\f]*(?:#[^\r\n]*)?\r?\n)?[ \t\f]*#[^\r\n]*?coding[:=][ \t]*)([-\w.]+)/;

const decoded = (bytes: Uint8Array, coding: string) => new TextDecoder(coding, { fatal: true }).decode(bytes);

/** UTF-8, UTF-16 with its mark, or what a coding line says, which then says UTF-8; undefined of all else. */
export function textOf(data: ArrayBuffer | Uint8Array): string | undefined {
  const bytes = new Uint8Array(data);
  const [first, second] = bytes;
  try {
    if (first === 0xff && second === 0xfe) return decoded(bytes, "utf-16le"); // as a Windows shell's > writes
    if (first === 0xfe && second === 0xff) return decoded(bytes, "utf-16be");
    return decoded(bytes, "utf-8");
  } catch {
    const said = CODING.exec(new TextDecoder("latin1").decode(bytes.subarray(0, 2000)));
    const coding = said && CODINGS[said[2]!.toLowerCase().replaceAll("_", "-")];
    if (!coding) return undefined;
    return decoded(bytes, coding).replace(CODING, "$1utf-8");
  }
}
