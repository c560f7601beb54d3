import type { Point } from "./curves";

/** Whether the cars that are seen wait for a teacher, which learns before the first camera step. */
export const hasTeacherNow = (settings: Record<string, unknown>, step: number | undefined): boolean =>
  settings["algorithm"] === "distill" && !step;

/** How much a teacher has learned, 0 to 1, by the newest iteration of a model that has driven so many steps; null where
 * none learns any more, and where an old run does not say. */
export function lessonOf(last: Point | undefined, steps: number): number | null {
  const lesson = last?.["lesson"];
  if (typeof lesson !== "number" || last!.step < steps) return null; // iterations in quick succession are left out
  return Math.floor(100 * lesson + 1e-9) / 100; // all of it only at the end
}

/** Camera steps a second of an iteration; null of a teacher's, in which no camera looks, and where nobody knows. */
export const paceOf = (point: Point | undefined): number | null =>
  typeof point?.["pace"] === "number" && typeof point["lesson"] !== "number" ? point["pace"] : null;
