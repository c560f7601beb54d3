import { describe, expect, it } from "vitest";
import { de as courseDe } from "../src/course/de";
import { en as courseEn } from "../src/course/en";
import { de } from "../src/i18n/de";
import { en } from "../src/i18n/en";
import { fill } from "../src/i18n/fill";
import { de as leagueDe } from "../src/league/de";
import { en as leagueEn } from "../src/league/en";
import { bound } from "../src/lib/numbers";
import { de as tabDe } from "../src/tab/de";
import { en as tabEn } from "../src/tab/en";

const MANY: Record<string, RegExp> = {
  en: /(?<![\d.,])1 (?:[a-z]+ )?(?:laps|races|cars|tracks|racers|cards|people|seeds|settings|iterations|episodes|exits|boxes|pulls)\b/,
  de: /(?<![\d.,])1 (?!der )(?:\p{Ll}+ )?(?:Runden|Autos|Bot-Autos|Strecken|Karten|Leute|Startwerte|Einstellungen|Iterationen|Episoden|Abflüge|Kisten|Fahrende)(?!\p{L})/u,
};
/** Of these there are never fewer than two. */
const SEVERAL = ["tracks_many", "tracks_many_lead", "replay_same", "bandit_pulls"];
const catalogues: [string, Record<string, string>[]][] = [
  ["en", [en, leagueEn, courseEn, tabEn]],
  ["de", [de, leagueDe, courseDe, tabDe]],
];

describe("a number and its noun", () => {
  it("go together for one as for many", () => {
    const text = "{count} {count|car waits|cars wait}";
    expect([0, 1, 2].map((count) => fill(text, { count }))).toEqual(
      ["0 cars wait", "1 car waits", "2 cars wait"].map(bound),
    );
    expect(fill("{a} of {b} {b|lap|laps}", { a: 0, b: 1 })).toBe(bound("0 of 1 lap"));
  });

  it.each(catalogues)("do in every sentence that is filled in, %s", (language, all) => {
    const wrong = all.flatMap((catalogue) =>
      Object.entries(catalogue).filter(([key, sentence]) => {
        const names = [...sentence.matchAll(/\{(\w+)/g)].map(([, name]) => [name!, 1]);
        return !SEVERAL.includes(key) && MANY[language]!.test(fill(sentence, Object.fromEntries(names)));
      }),
    );
    expect(wrong).toEqual([]);
  });
});
