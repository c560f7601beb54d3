/** A road as a route file of AWS's, which the installed program takes: an array of NumPy's, (W, 6) float64 in metres. */
import { doublesOf, type TrackFile } from "../plan";

export function routeOf({ told }: TrackFile): Blob {
  const { count } = told;
  const lines = doublesOf(told.lines);
  const rows = Float64Array.from({ length: 6 * count }, (_, at) => {
    const [row, column] = [Math.floor(at / 6), at % 6];
    return lines[(column >> 1) * 2 * count + 2 * row + (column % 2)]!;
  });
  const about = `{'descr': '<f8', 'fortran_order': False, 'shape': (${count}, 6), }`;
  const header = `${about.padEnd(128 - 10 - 1)}\n`;
  const begin = Uint8Array.of(0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, header.length & 255, header.length >> 8);
  return new Blob([begin, header, rows], { type: "application/octet-stream" });
}
