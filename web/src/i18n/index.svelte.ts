/** Texts in the chosen language. */
import { de } from "./de";
import { untilInEnglish, untilInGerman } from "./de/until";
import { en, type Key } from "./en";
import { fill, type Values } from "./fill";
import { choose, language, type Language } from "./language.svelte";
import { translator } from "./sentences";
import { bound, fixed } from "../lib/numbers";

export { language, languages, type Language } from "./language.svelte";

const catalogues: Record<Language, Record<Key, string>> = { en, de };

/** In languages other than the server's own. */
let translated = $state.raw<((text: string) => string) | undefined>();

/** Fetch what the server's errors are in the chosen language; `said` speaks it from then on. */
export async function learnErrors(): Promise<void> {
  if (language.choice === "en" || translated) return;
  translated = translator((await import("./de/errors.json")).default, fixed);
}
void learnErrors();

/** What the server said, in the page's language where it is known there. */
export const said = (text: string): string => bound(language.choice !== "en" && translated ? translated(text) : text);

/** When a training ends, as the server says it, in the page's language. */
export const untilShown = (text: string): string => (language.choice === "de" ? untilInGerman(text) : text);

/** When a training is to end, as somebody wrote it, for the server, which says what is wrong with it. */
export const untilMeant = (words: string): string => (language.choice === "de" ? untilInEnglish(words) : words);

export function speak(choice: Language): void {
  choose(choice);
  void learnErrors();
}

/** The text of a key, with {names} filled in. */
export const t = (key: Key, values: Values = {}): string => fill(catalogues[language.choice][key], values);

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
