import { expect, test } from "vitest";
import { inFours, secretOf } from "./card";

test("a card is read from each of the ways to type what stands under its code", () => {
  for (const typed of [
    "A6WU-PAKD-WY",
    " A6WU-PAKD-WY\n",
    "A6WU- PAKD- WY",
    "http://192.168.1.20:8321/card A6WU-PAKD-WY",
    "http://192.168.1.20:8321/cardA6WU-PAKD-WY",
    "http://192.168.1.20:8321/card#A6WU-PAKD-WY",
  ])
    expect(secretOf(typed)).toBe("A6WU-PAKD-WY");
});

test("a secret is printed in fours", () => {
  expect([inFours("A6WUPAKDWY"), inFours("")]).toEqual(["A6WU-PAKD-WY", ""]);
});
