/** Sentences of every catalogue, with what they leave open. */
import { bound, plain } from "../lib/numbers";

export type Values = Record<string, string | number>;

/** The text with {names} filled in; numbers as the page's language writes them, and with their units. */
export const fill = (text: string, values: Values): string =>
  bound(
    text.replace(/\{(\w+)\}/g, (_, name: string) => {
      const value = values[name] ?? "";
      return typeof value === "number" ? plain(value) : value;
    }),
  );
