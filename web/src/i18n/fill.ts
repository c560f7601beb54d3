/** Sentences of every catalogue, with what they leave open. */
import { bound, plain } from "../lib/numbers";

export type Values = Record<string, string | number>;

/**
 * The text with {names} filled in; numbers as the page's language writes them, and with their units.
 *
 * {name|car|cars} is the first word where that number is one, else the second.
 */
export const fill = (text: string, values: Values): string =>
  bound(
    text.replace(/\{(\w+)(?:\|([^|{}]*)\|([^|{}]*))?\}/g, (_, name: string, one?: string, many?: string) => {
      const value = values[name] ?? "";
      if (one !== undefined && many !== undefined) return value === 1 ? one : many;
      return typeof value === "number" ? plain(value) : value;
    }),
  );
