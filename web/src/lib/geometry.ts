/** Tracks as SVG paths; y points up on a track and down on a screen. */
export type Line = number[][];

export const path = (line: Line, isClosed: boolean): string =>
  line.map(([x, y], index) => `${index ? "L" : "M"}${x!.toFixed(3)} ${(-y!).toFixed(3)}`).join("") +
  (isClosed ? "Z" : "");

/** viewBox around some lines. */
export function viewBox(lines: Line[], margin: number): string {
  const xs = lines.flatMap((line) => line.map((point) => point[0]!));
  const ys = lines.flatMap((line) => line.map((point) => -point[1]!));
  const [left, top] = [Math.min(...xs) - margin, Math.min(...ys) - margin];
  return [left, top, Math.max(...xs) + margin - left, Math.max(...ys) + margin - top]
    .map((v) => v.toFixed(3))
    .join(" ");
}
