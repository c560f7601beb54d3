/** The language of the page; kept in this browser. */
import { browser } from "../lib/remembered";

export const languages = { en: "English", de: "Deutsch" } as const;
export type Language = keyof typeof languages;

const STORE = "racecraft-language";
const first = browser.read(STORE) ?? navigator.language.slice(0, 2);
export const language = $state({ choice: (Object.hasOwn(languages, first) ? first : "en") as Language });
document.documentElement.lang = language.choice;

export function choose(choice: Language): void {
  language.choice = choice;
  browser.write(STORE, choice);
  document.documentElement.lang = choice;
}
