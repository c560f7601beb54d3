/** Texts of the course in the chosen language: a catalogue of its own. */
import { fill, type Values } from "../i18n/fill";
import { language, type Language } from "../i18n/index.svelte";
import { de } from "./de";
import { en, type CourseKey } from "./en";

const catalogues: Record<Language, Record<CourseKey, string>> = { en, de };

/** The text of a key, with {names} filled in. */
export const c = (key: CourseKey, values: Values = {}): string => fill(catalogues[language.choice][key], values);

/** The command that runs a lesson, or opens it as a notebook, in the chosen language. */
export const command = (verb: "run" | "open", lesson: { number: number }): string =>
  `racecraft lessons ${verb} ${lesson.number}${language.choice === "en" ? "" : ` --language ${language.choice}`}`;

/** A lesson's words in the chosen language. */
export const said = (words: { en: string; de: string }): string => words[language.choice];
