/** In which car, and under what otherwise than they know, models drive: what forms ask, files hold and pages tell. */
import type { Choices } from "../api/client";
import { t } from "../i18n/index.svelte";
import { plain } from "./numbers";

export type Car = Record<string, number>; // by parameter
export type Ranges = Record<string, [number, number]>; // by quantity
export type AskedCar = string | Car; // a preset, or numbers of one's own; those left out are v5's
export type AskedRanges = string | Ranges; // a preset, or what differs

export const RANDOMIZATIONS = ["none", "light", "strong", "real", "aws"] as const;
const MOST = 100_000; // characters, as on the command line

/** Every number of a car, to begin with when one's own are wanted. */
export const wholeCar = (car: AskedCar, choices: Choices): Car =>
  typeof car === "string" ? { ...choices.cars[car || "v5"]! } : { ...choices.cars["v5"]!, ...car };

/** The ranges of a preset that change something. */
export function differingRanges(preset: string, choices: Choices): Ranges {
  const [all, nothing] = [choices.ranges[preset] ?? {}, choices.ranges["none"]!] as [Ranges, Ranges];
  const differing = Object.entries(all).filter(([name, ends]) => ends.join() !== nothing[name]!.join());
  return Object.fromEntries(differing.map(([name, [low, high]]) => [name, [low, high]]));
}

/** A vehicle file's numbers, those that it leaves out as v5 has them. */
export function carOfFile(text: string, choices: Choices): Car {
  const whole = wholeCar("v5", choices);
  for (const [name, value] of entriesOf(text)) {
    if (!(name in whole)) throw new Error(t("file_unknown", { name }));
    if (!isNumber(value)) throw new Error(t("file_no_number", { name }));
    whole[name] = value;
  }
  return whole;
}

/** What a file of ranges changes, those of its preset included. */
export function rangesOfFile(text: string, choices: Choices): Ranges {
  const entries = entriesOf(text);
  const preset = entries.find(([name]) => name === "preset")?.[1] ?? "none";
  if (typeof preset !== "string" || !(preset in choices.ranges)) throw new Error(t("file_no_preset"));
  const ranges = differingRanges(preset, choices);
  for (const [name, value] of entries) {
    if (name === "preset") continue;
    if (!(name in choices.ranges["none"]!)) throw new Error(t("file_unknown", { name }));
    if (!isRange(value)) throw new Error(t("file_no_range", { name }));
    ranges[name] = [...value];
  }
  return ranges;
}

const isNumber = (value: unknown): value is number => typeof value === "number" && Number.isFinite(value);

const isRange = (value: unknown): value is [number, number] =>
  Array.isArray(value) && value.length === 2 && value.every(isNumber);

function entriesOf(text: string): [string, unknown][] {
  let found: unknown;
  try {
    found = text.length > MOST ? undefined : JSON.parse(text);
  } catch {
    found = undefined;
  }
  if (found === null || typeof found !== "object" || Array.isArray(found)) throw new Error(t("file_no_object"));
  return Object.entries(found);
}

/** A car in words. */
export const toldCar = (car: AskedCar): string =>
  car === "v5" ? t("car_default") : typeof car === "string" ? car : told("car_own", car);

/** What is otherwise than models know, in words. */
export function toldRanges(ranges: AskedRanges): string {
  const preset = RANDOMIZATIONS.find((one) => one === ranges);
  if (preset) return t(`randomize_${preset}`);
  return typeof ranges === "string" ? ranges : told("randomize_own", ranges);
}

const told = (name: "car_own" | "randomize_own", numbers: Car | Ranges): string =>
  `${t(name)}: ${Object.entries(numbers)
    .map(([key, value]) => `${key} ${typeof value === "number" ? plain(value) : toldRange(value)}`)
    .join(" · ")}`;

const toldRange = ([low, high]: [number, number]) => (low === high ? plain(low) : `${plain(low)} – ${plain(high)}`);
