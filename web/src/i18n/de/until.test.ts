import { expect, test } from "vitest";
import { untilInEnglish, untilInGerman } from "./until";

test.each([
  ["5 laps", "5 Runden"],
  ["8.85 s lap or 30 minutes", "8,85 s Runde oder 30 Minuten"],
  ["no better lap or 200000 steps", "keine bessere Runde oder 200000 Schritte"],
  ["1.5 hours or 1 minute or 90 s", "1,5 Stunden oder 1 Minute oder 90 s"],
])("%s is %s, and back", (english, german) => {
  expect(untilInGerman(english)).toBe(german);
  expect(untilInEnglish(german)).toBe(english);
});

test.each([
  ["200.000 Schritte", "200000 steps"],
  ["1.200.000 steps", "1200000 steps"],
  ["200,000 steps", "200,000 steps"],
  ["5 laps or 10 minutes", "5 laps or 10 minutes"],
  ["5 RUNDEN Oder 10 minuten", "5 laps or 10 minutes"],
  ["8.850 s lap", "8.850 s lap"],
  ["5 Rundungen", "5 Rundungen"],
])("%s is understood as %s", (words, english) => {
  expect(untilInEnglish(words)).toBe(english);
});
