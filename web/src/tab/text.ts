/** Texts of the page in a tab in the chosen language: a catalogue of its own. */
import { fill, type Values } from "../i18n/fill";
import { language, type Language } from "../i18n/index.svelte";
import { de } from "./de";
import { en, type TabKey } from "./en";

const catalogues: Record<Language, Record<TabKey, string>> = { en, de };

/** The text of a key, with {names} filled in. */
export const l = (key: TabKey, values: Values = {}): string => fill(catalogues[language.choice][key], values);
