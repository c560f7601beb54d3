/** Numbers as people write them in the page's language: all that is shown goes through here. What machines read (fields'
 *  values, addresses, drawings, files) keeps JavaScript's own. */
import { language } from "../i18n/language.svelte";

export const NONE = "–";

type Value = number | null | undefined;
const isKnown = (value: Value): value is number => value != null && Number.isFinite(value);

/** Formats are costly to make and are asked for at every frame. */
const formats = new Map<string, Intl.NumberFormat>();

function write(value: number, name: string, options: Intl.NumberFormatOptions): string {
  const key = `${language.choice} ${name}`;
  let format = formats.get(key);
  if (!format) {
    format = new Intl.NumberFormat(language.choice, { signDisplay: "negative", ...options });
    formats.set(key, format);
  }
  return format.format(value).replace("-", "−");
}

/** With so many digits after the sign: 9.274 → 9.27 or 9,27; minus nothing is nothing. */
export const fixed = (value: Value, digits: number): string =>
  isKnown(value)
    ? write(value, `fixed ${digits}`, { minimumFractionDigits: digits, maximumFractionDigits: digits })
    : NONE;

/** With so many digits that count: 0.000123456 → 0.0001235. */
export const short = (value: Value, digits = 4): string =>
  isKnown(value) ? write(value, `short ${digits}`, { maximumSignificantDigits: digits }) : NONE;

/** As it is, and ungrouped: a setting, a place in a list, an angle. */
export const plain = (value: Value): string =>
  isKnown(value) ? write(value, "plain", { maximumSignificantDigits: 15, useGrouping: false }) : NONE;

/** Numbers and their units stay on one line: what stands between them is no place to break it. */
const NO_BREAK = "\u00a0";
const UNITS = "m/s|km/h|ms|s|min|h|mm|cm|m|km|°C|°|%|B|kB|MB|GB|TB|Hz|px";
const PARTED = new RegExp(`(\\d) (?=(?:${UNITS})(?![\\p{L}\\d]))`, "gu");

/** A text in which no line ends between a number and its unit. */
export const bound = (text: string): string => text.replace(PARTED, `$1${NO_BREAK}`);

/** The same with ordinary spaces, as people type them. */
export const loose = (text: string): string => text.replaceAll(NO_BREAK, " ");

/** A number as it is, with its unit: 0.5, "m/s" → 0.5 m/s. */
export const withUnit = (value: Value, unit: string): string =>
  isKnown(value) ? `${plain(value)}${NO_BREAK}${unit}` : NONE;

/** 9.274, "m" → 9.27 m. */
export const measured = (value: Value, unit: string, digits = 2): string =>
  isKnown(value) ? `${fixed(value, digits)}${NO_BREAK}${unit}` : NONE;

/** Of a road: 0.6 m → 60 cm. */
export const centimetres = (metres: Value): string => measured(metres == null ? metres : 100 * metres, "cm", 0);

export const seconds = (value: Value, digits = 2): string => measured(value, "s", digits);

/** A difference: +0.23, −0.23. */
export const signed = (value: Value, digits = 2): string =>
  isKnown(value)
    ? write(value, `signed ${digits}`, {
        minimumFractionDigits: digits,
        maximumFractionDigits: digits,
        signDisplay: "exceptZero",
      })
    : NONE;

/** How far behind somebody is: +0.23 s. */
export const behind = (value: Value): string => (isKnown(value) ? `${signed(value)}${NO_BREAK}s` : NONE);

/** A share: 0.982 → 98 %. */
export const percent = (value: Value): string => (isKnown(value) ? `${fixed(100 * value, 0)}${NO_BREAK}%` : NONE);

export const count = (value: Value): string => fixed(value, 0);

/** The number of a graph's axis: 12500 → 12,500, 0.25 → 0.25. */
export const tick = (value: number): string =>
  Number.isInteger(value) && Math.abs(value) >= 1000 ? count(value) : short(value, 6);

/** 75 → 1:15, 3700 → 1:01:40. */
export function clock(value: Value): string {
  if (!isKnown(value)) return NONE;
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
  return measured(scaled, units[power]!, scaled < 10 && power ? 1 : 0);
}
