/** Texts of a league in the chosen language: a catalogue of its own, loaded with its pages. */
import { fill, type Values } from "../i18n/fill";
import { language, type Language } from "../i18n/index.svelte";
import { de } from "./de";
import { en, type LeagueKey } from "./en";

const catalogues: Record<Language, Record<LeagueKey, string>> = { en, de };

/** The text of a key, with {names} filled in. */
export const l = (key: LeagueKey, values: Values = {}): string => fill(catalogues[language.choice][key], values);
