import { afterEach, describe, expect, it } from "vitest";
import errors from "../src/i18n/de/errors.json";
import { de as courseDe } from "../src/course/de";
import { en as courseEn } from "../src/course/en";
import { de } from "../src/i18n/de";
import { en } from "../src/i18n/en";
import { fill } from "../src/i18n/fill";
import { learnErrors, said } from "../src/i18n/index.svelte";
import { choose } from "../src/i18n/language.svelte";
import { de as leagueDe } from "../src/league/de";
import { en as leagueEn } from "../src/league/en";
import { behind, bound, bytes, centimetres, loose, measured, percent, seconds, withUnit } from "../src/lib/numbers";
import { toldObjects, toldRules } from "../src/lib/raceterms";
import { de as tabDe } from "../src/tab/de";
import { en as tabEn } from "../src/tab/en";

const UNIT = String.raw`(?:m/s|km/h|ms|s|min|h|mm|cm|m|km|°C|°|%|B|kB|MB|GB|TB|Hz|px)(?![\p{L}\d])`;
const PARTED = new RegExp(String.raw`\d ${UNIT}`, "u");
const catalogues: Record<string, string>[] = [en, de, leagueEn, leagueDe, courseEn, courseDe, tabEn, tabDe];
const sources = import.meta.glob<string>("../src/**/*.{svelte,ts}", { query: "?raw", import: "default", eager: true });

describe("a number and its unit", () => {
  afterEach(() => choose("en"));

  it("stay on one line wherever numbers are written", () => {
    const written = () => [
      ...[seconds(10.5), measured(1, "m/s"), centimetres(0.6), behind(0.23), percent(0.98), bytes(1.3e9)],
      ...[withUnit(0.5, "m/s"), withUnit(undefined, "s")],
    ];
    expect(written()).toEqual(
      ["10.50 s", "1.00 m/s", "60 cm", "+0.23 s", "98 %", "1.3 GB", "0.5 m/s", "–"].map((one) => bound(one)),
    );
    choose("de");
    for (const one of written()) expect(one).not.toMatch(/ /);
  });

  it("stay on one line in every sentence of every catalogue", () => {
    for (const catalogue of catalogues)
      for (const [key, sentence] of Object.entries(catalogue)) {
        const values = Object.fromEntries([...sentence.matchAll(/\{(\w+)\}/g)].map(([, name]) => [name!, "7"]));
        expect(PARTED.exec(fill(sentence, values)), key).toBeNull();
      }
    expect(fill("{gap} s behind, after {laps} m", { gap: 1.5, laps: "2" })).toBe("1.5\u00a0s behind, after 2\u00a0m");
  });

  it("stay on one line in what the server says, in either language", async () => {
    const told = "The road is 0.30 m wide at waypoint 3; at least 0.4 m is allowed.";
    expect(loose(said(told))).toBe(told);
    expect(said(told)).not.toMatch(PARTED);
    choose("de");
    await learnErrors();
    for (const sentence of Object.keys(errors)) expect(said(sentence.replaceAll("{}", "7"))).not.toMatch(PARTED);
  });

  it("stay on one line in rules, objects and actions that are told", () => {
    const objects = { bots: { count: 2, speed: 0.5, placement: "fixed", positions: [[0.4, 1]] } };
    const rules = { laps: 1, offtrack_penalty: 5, collision_penalty: 5, max_resets: 1, time_limit: 9 };
    const told = [toldObjects(objects), ...toldRules(rules).flat()];
    for (const one of told) expect(one).not.toMatch(PARTED);
    expect(told.map(loose)).toContain("Bot cars: 2 · 0.5 m/s · 40 % inner lane");
  });

  it("have no words taken for units", () => {
    for (const text of ["3 starts", "5 steps", "2 made it", "1 hour", "7 minutes", "10 pixels", "a s", "s 5"])
      expect(bound(text)).toBe(text);
  });

  it("are put together by what binds them, in no template of a page", () => {
    const template = new RegExp(String.raw`\}\s${UNIT}(?!=)`, "u"); // an attribute is no unit
    for (const [path, source] of Object.entries(sources))
      if (path.endsWith(".svelte") || path.includes("/lib/")) expect(template.exec(source)?.[0], path).toBeUndefined();
  });
});
