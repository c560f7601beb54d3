/** What the server says, in another language: sentences with gaps, of which the longest that fits a text is taken. */

/** By the sentence as the server says it, `{}` for what it fills in: the other one, with `{}` in the same order or `{0}`, `{1}` in its own. */
export type Sentences = Record<string, string>;

interface Sentence {
  /** What stands between the gaps. */
  parts: string[];
  pattern: RegExp;
  other: string;
}

const GAP = "{}";
const RANGE = "{} to {}"; // no sentence, which would fit many a text, but what a gap is filled with: two numbers
const NUMBERS = /^-?\d[\d.,]*(e[-+]?\d+)? to -?\d[\d.,]*(e[-+]?\d+)?$/;
const DECIMAL = /^-?\d+\.(\d+)$/;
const MANY = /^\d{1,3}(,\d{3})+$/;
const LONGEST = 600; // characters of a line that is looked for: names are short, and a stranger's text may not be

/** Says a text in the other language, line by line; what it has no sentence for stays as it is. `number` writes a number with
 *  so many digits after its sign. */
export function translator(
  sentences: Sentences,
  number: (value: number, digits: number) => string,
): (text: string) => string {
  const { [RANGE]: range = RANGE, ...whole } = sentences;
  const known = Object.entries(whole)
    .map(([one, other]): Sentence => {
      const parts = one.split(GAP);
      const pattern = new RegExp(`^${parts.map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("(.*?)")}$`);
      return { parts, pattern, other };
    })
    .sort((a, b) => b.parts.join("").length - a.parts.join("").length);

  /** What fills a gap: words that have a sentence of their own, or a number. */
  function filled(text: string): string {
    if (NUMBERS.test(text)) return put(range, text.split(" to "));
    const digits = DECIMAL.exec(text)?.[1];
    if (MANY.test(text)) return number(Number(text.replaceAll(",", "")), 0);
    return digits ? number(Number(text), digits.length) : line(text);
  }

  function put(other: string, gaps: string[]): string {
    let next = 0;
    return other.replace(/\{(\d*)\}/g, (_, place: string) => filled(gaps[place ? Number(place) : next++] ?? ""));
  }

  function line(text: string): string {
    const same = sentences[text];
    if (same !== undefined && !text.includes(GAP)) return same;
    if (!text || text.length > LONGEST) return text;
    for (const { parts, pattern, other } of known) {
      if (!parts.every((part) => text.includes(part))) continue;
      const gaps = pattern.exec(text)?.slice(1);
      if (!gaps || gaps.includes(text)) continue;
      return put(other, gaps);
    }
    return text;
  }
  return (text) => text.split("\n").map(line).join("\n");
}
