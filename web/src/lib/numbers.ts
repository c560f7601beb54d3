/** Numbers as people read them. */
export const NONE = "–";

export const seconds = (value: number | null | undefined, digits = 2): string =>
  value == null || !Number.isFinite(value) ? NONE : `${value.toFixed(digits)} s`;

export const percent = (value: number | null | undefined): string =>
  value == null || !Number.isFinite(value) ? NONE : `${Math.round(100 * value)} %`;

export const count = (value: number | null | undefined): string =>
  value == null ? NONE : Math.round(value).toLocaleString("en-US").replaceAll(",", "\u202f");

/** The number of a graph's axis: 12500 → 12 500, 0.25 → 0.25. */
export const tick = (value: number): string =>
  Number.isInteger(value) && Math.abs(value) >= 1000 ? count(value) : String(+value.toPrecision(6));

/** 0.000123456 → 0.0001235: four digits that count. */
export const short = (value: number): string => String(Number(value.toPrecision(4)));

/** 75 → 1:15, 3700 → 1:01:40. */
export function clock(value: number | null | undefined): string {
  if (value == null || !Number.isFinite(value)) return NONE;
  const whole = Math.max(0, Math.round(value));
  const parts = [Math.floor(whole / 60) % 60, whole % 60].map((part) => String(part).padStart(2, "0"));
  const hours = Math.floor(whole / 3600);
  return hours ? `${hours}:${parts.join(":")}` : `${Math.floor(whole / 60)}:${parts[1]}`;
}

/** 1,300,000,000 → 1.3 GB. */
export function bytes(value: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  const power = Math.min(units.length - 1, Math.max(0, Math.floor(Math.log10(Math.max(1, value)) / 3)));
  const scaled = value / 1000 ** power;
  return `${scaled < 10 && power ? scaled.toFixed(1) : Math.round(scaled)} ${units[power]}`;
}
