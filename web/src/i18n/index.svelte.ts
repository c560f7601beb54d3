/** Texts in the chosen language; kept in this browser. */
import { de } from "./de";
import { en, type Key } from "./en";
import { translator } from "./sentences";

export const languages = { en: "English", de: "Deutsch" } as const;
export type Language = keyof typeof languages;

const STORE = "racecraft-language";
const catalogues: Record<Language, Record<Key, string>> = { en, de };
const first = localStorage.getItem(STORE) ?? navigator.language.slice(0, 2);
export const language = $state({ choice: (first in catalogues ? first : "en") as Language });
document.documentElement.lang = language.choice;

/** In languages other than the server's own. */
let translated = $state.raw<((text: string) => string) | undefined>();

/** Fetch what the server's errors are in the chosen language; `said` speaks it from then on. */
export async function learnErrors(): Promise<void> {
  if (language.choice === "en" || translated) return;
  translated = translator((await import("./de/errors.json")).default);
}
void learnErrors();

/** What the server said, in the page's language where it is known there. */
export const said = (text: string): string => (language.choice !== "en" && translated ? translated(text) : text);

export function speak(choice: Language): void {
  language.choice = choice;
  void learnErrors();
  localStorage.setItem(STORE, choice);
  document.documentElement.lang = choice;
}

/** The text of a key, with {names} filled in. */
export function t(key: Key, values: Record<string, string | number> = {}): string {
  return catalogues[language.choice][key].replace(/\{(\w+)\}/g, (_, name: string) => String(values[name] ?? ""));
}

/** The text of a key, or what there is where the catalogue has none. */
export const known = (key: Key | undefined, otherwise: string): string => (key ? t(key) : otherwise);

/** What the server calls something, in the page's language where the catalogue knows it. */
export function named(
  group: "preset" | "preset_name" | "space" | "space_name" | "situation",
  name: string,
  otherwise: string,
): string {
  const key = `${group}_${name.replaceAll(" ", "_")}`;
  return Object.hasOwn(en, key) ? t(key as Key) : otherwise;
}
