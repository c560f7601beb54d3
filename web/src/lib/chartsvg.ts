/** A line chart as an SVG text of its own, for reports and slides. On the page uPlot draws the same on a canvas, which
 *  follows thousands of live points and a cursor, but cannot be saved as lines and words; hence two. */
import { percent, tick } from "./numbers";
import { span } from "./colors";
import type { Band } from "./stretches";

export interface ChartLine {
  label: string;
  values: (number | null)[];
  color: string; // CSS
  points?: boolean;
}

const [WIDTH, LEFT, RIGHT, TOP, BOTTOM] = [960, 70, 20, 40, 46];

const escape = (text: string) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);

/** Round numbers from low to high, about so many; of what is counted, whole ones. */
export function ticks(low: number, high: number, count = 6, isWhole = false): number[] {
  if (!(high > low)) return [low];
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const round = power * ([1, 2, 2.5, 5].find((factor) => power * factor >= rough * 0.999) ?? 10);
  const step = isWhole ? Math.max(1, Math.ceil(round)) : round;
  const found: number[] = [];
  for (let index = Math.ceil(low / step - 1e-9); index * step <= high + 1e-9 * step; index++)
    found.push(+(index * step).toPrecision(12));
  return found;
}

/** What of bands lies where there are points: a stretch may begin before the first one, where the other axis stands. */
export const bandsWithin = (bands: Band[], x: number[]): Band[] =>
  bands
    .map((band) => ({ ...band, from: Math.max(band.from, x[0] ?? 0), to: Math.min(band.to, x.at(-1) ?? 0) }))
    .filter(({ from, to }) => to > from);

export function chartSvg(chart: {
  title: string;
  x: number[];
  lines: ChartLine[];
  xLabel: string;
  isPercent?: boolean;
  isWhole?: boolean;
  least?: number;
  marks?: number[];
  bands?: Band[];
  mark?: string;
  height?: number;
  ink: string;
  quiet: string;
  grid: string;
  card: string;
}): string {
  const height = chart.height ?? 420;
  const known = chart.lines.flatMap((line) => line.values.filter((value): value is number => value !== null));
  const [x0, x1] = chart.x.length ? [Math.min(...chart.x), Math.max(...chart.x)] : [0, 1];
  let [y0, y1] = known.length
    ? [known.reduce((a, b) => Math.min(a, b)), known.reduce((a, b) => Math.max(a, b))]
    : [0, 1];
  if (chart.least) [y0, y1] = span([y0, y1], chart.least);
  if (chart.isPercent) [y0, y1] = [Math.min(0, y0), Math.max(1, y1)];
  const space = (y1 - y0) * 0.05 || 0.5;
  [y0, y1] = chart.isPercent ? [y0, y1 + 0.04] : [y0 - space, y1 + space];
  const px = (x: number) => LEFT + ((WIDTH - LEFT - RIGHT) * (x - x0)) / (x1 - x0 || 1);
  const py = (y: number) => TOP + (height - TOP - BOTTOM) * (1 - (y - y0) / (y1 - y0));
  const text = (x: number, y: number, words: string, more = "") =>
    `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" ${more}>${escape(words)}</text>`;
  const parts: string[] = [];
  for (const band of bandsWithin(chart.bands ?? [], chart.x)) {
    const [from, to] = [px(band.from), px(band.to)];
    parts.push(
      `<rect x="${from.toFixed(1)}" y="${TOP}" width="${(to - from).toFixed(1)}" height="${height - TOP - BOTTOM}" fill="${band.color}" fill-opacity="0.13"><title>${escape(band.label)}</title></rect>`,
    );
  }
  for (const at of ticks(y0, y1)) {
    parts.push(`<path d="M${LEFT} ${py(at).toFixed(1)}H${WIDTH - RIGHT}" stroke="${chart.grid}"/>`);
    parts.push(text(LEFT - 8, py(at) + 4, chart.isPercent ? percent(at) : tick(at), 'text-anchor="end"'));
  }
  for (const at of ticks(x0, x1, 8, chart.isWhole))
    parts.push(text(px(at), height - BOTTOM + 20, tick(at), 'text-anchor="middle"'));
  parts.push(text(WIDTH - RIGHT, height - 8, chart.xLabel, 'text-anchor="end"'));
  parts.push(
    `<text x="${LEFT}" y="24" font-weight="600" font-size="15" fill="${chart.ink}">${escape(chart.title)}</text>`,
  );
  let place = WIDTH - RIGHT;
  for (const line of [...chart.lines].reverse()) {
    parts.push(text(place, 24, line.label, `text-anchor="end" fill="${line.color}"`));
    place -= 9 * line.label.length + 18;
  }
  for (const place of chart.marks ?? []) {
    parts.push(
      `<path d="M${px(place).toFixed(1)} ${TOP}V${height - BOTTOM}" stroke="${chart.mark ?? chart.ink}" stroke-dasharray="4 4"/>`,
    );
    parts.push(text(px(place), TOP - 2, "★", `text-anchor="middle" font-size="14" fill="${chart.mark ?? chart.ink}"`));
  }
  for (const line of chart.lines) {
    if (line.points) {
      line.values.forEach(
        (value, index) =>
          value !== null &&
          parts.push(
            `<circle cx="${px(chart.x[index]!).toFixed(1)}" cy="${py(value).toFixed(1)}" r="3.5" fill="${line.color}"/>`,
          ),
      );
      continue;
    }
    let d = "";
    line.values.forEach((value, index) => {
      if (value !== null) d += `${d ? "L" : "M"}${px(chart.x[index]!).toFixed(1)} ${py(value).toFixed(1)}`;
    });
    parts.push(`<path d="${d}" fill="none" stroke="${line.color}" stroke-width="2" stroke-linejoin="round"/>`);
  }
  return (
    `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${WIDTH} ${height}" width="${WIDTH}" height="${height}" font-family="system-ui, sans-serif" font-size="12" fill="${chart.quiet}">` +
    `<rect width="${WIDTH}" height="${height}" fill="${chart.card}"/>${parts.join("")}</svg>`
  );
}
