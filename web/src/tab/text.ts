/** Texts of the page in a tab in the chosen language: a catalogue of its own. */
import { fill, type Values } from "../i18n/fill";
import { language, type Language } from "../i18n/index.svelte";
import { de } from "./de";
import { en, type TabKey } from "./en";

const catalogues: Record<Language, Record<TabKey, string>> = { en, de };

/** What went wrong, as a sentence; `full`: what is said where the browser has no room for it. Where it has no storage at all it says so in its
 *  own words, which name neither the cause nor a way out. */
export function why(error: unknown, full: TabKey = "full"): string {
  if (!(error instanceof Error)) return String(error);
  if (error.name === "NothingKept") return l("nothing_kept");
  return error.name === "QuotaExceededError" ? l(full) : error.message;
}

/** The text of a key, with {names} filled in. */
export const l = (key: TabKey, values: Values = {}): string => fill(catalogues[language.choice][key], values);
