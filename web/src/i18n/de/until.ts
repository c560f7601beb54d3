/** When a training ends, in German and back: the server writes and reads it in English. */

/** Longer phrases first; each with what is understood, too. */
const PHRASES: [english: string, german: string, understood: RegExp][] = [
  ["no better lap", "keine bessere Runde", /\bkeine\s+bessere\s+runde\b/gi],
  ["laps", "Runden", /\brunden\b/gi],
  ["lap", "Runde", /\brunde\b/gi],
  ["minutes", "Minuten", /\bminuten\b/gi],
  ["minute", "Minute", /\bminute\b/gi],
  ["hours", "Stunden", /\bstunden\b/gi],
  ["hour", "Stunde", /\bstunde\b/gi],
  ["seconds", "Sekunden", /\bsekunden\b/gi],
  ["second", "Sekunde", /\bsekunde\b/gi],
  ["steps", "Schritte", /\bschritten?\b/gi],
  ["step", "Schritt", /\bschritt\b/gi],
  ["or", "oder", /\boder\b/gi],
];
const COMMA = /(\d),(\d{1,2})(?!\d)/g; // "200,000" groups digits, as the server has it
const GROUPED = /\d{1,3}(?:\.\d{3})+(?=\s*s(?:chritt|tep))/gi;

export const untilInGerman = (text: string): string =>
  PHRASES.reduce(
    (said, [english, german]) => said.replace(new RegExp(`\\b${english}\\b`, "gi"), german),
    text.replace(/(\d)\.(\d)/g, "$1,$2"),
  );

/** English words stay as they are, so that both are understood. */
export const untilInEnglish = (words: string): string =>
  PHRASES.reduce(
    (said, [english, , understood]) => said.replace(understood, english),
    words.replace(GROUPED, (number) => number.replaceAll(".", "")).replace(COMMA, "$1.$2"),
  );
