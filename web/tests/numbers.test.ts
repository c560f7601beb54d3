import { afterAll, beforeEach, expect, test } from "vitest";
import { fill } from "../src/i18n/fill";
import { choose } from "../src/i18n/language.svelte";
import { translator } from "../src/i18n/sentences";
import { behind, bytes, centimetres, clock, count, fixed, percent } from "../src/lib/numbers";
import { loose, plain, seconds, short, signed, tick } from "../src/lib/numbers";

beforeEach(() => choose("en"));

const written = () => [
  ...[seconds(9.274), fixed(-1.25, 1), signed(0.234), behind(-0.2), signed(0), centimetres(0.616)],
  ...[count(12500), count(-1000), tick(1000), tick(0.25), tick(2500.5), short(0.000123456), short(3)],
  ...[plain(0.0003), plain(-12.5), plain(12345), percent(0.984), bytes(1.3e9), bytes(999), clock(3700)],
];

test("numbers are written as the page's language writes them", () => {
  const english = [
    ...["9.27 s", "−1.3", "+0.23", "−0.20 s", "0.00", "62 cm"],
    ...["12,500", "−1,000", "1,000", "0.25", "2,500.5", "0.0001235", "3"],
    ...["0.0003", "−12.5", "12345", "98 %", "1.3 GB", "999 B", "1:01:40"],
  ];
  expect(written().map(loose)).toEqual(english);
  choose("de");
  const swapped = (text: string) => text.replace(/[.,]/g, (sign) => (sign === "." ? "," : "."));
  expect(written().map(loose)).toEqual(english.map(swapped));
});

test("what is not known is a dash, and minus nothing is nothing", () => {
  for (const write of [seconds, percent, count, signed, behind, centimetres, plain, clock, short])
    expect([null, undefined, NaN, Infinity].map((value) => write(value))).toEqual(Array(4).fill("–"));
  expect([fixed(-0.001, 2), signed(-0.001), count(-0.2)]).toEqual(["0.00", "0.00", "0"]);
});

test("a sentence takes numbers in its language, and words as they are", () => {
  choose("de");
  expect(fill("{a} m, {b}, {c}", { a: 1.5, b: "1.5", c: 2000 })).toBe("1,5\u00a0m, 1.5, 2000");
  const said = translator({ "{} is {} m long.": "{} ist {} m lang." }, fixed);
  expect(said("road_1.5 is 0.30 m long.")).toBe("road_1.5 ist 0,30 m lang.");
  expect(said("1.2.3 is 4 m long.")).toBe("1.2.3 ist 4 m lang.");
});

afterAll(() => choose("en"));
