/** Sentences of every catalogue, with what they leave open. */
import { plain } from "../lib/numbers";

export type Values = Record<string, string | number>;

/** The text with {names} filled in; numbers as the page's language writes them. */
export const fill = (text: string, values: Values): string =>
  text.replace(/\{(\w+)\}/g, (_, name: string) => {
    const value = values[name] ?? "";
    return typeof value === "number" ? plain(value) : value;
  });
