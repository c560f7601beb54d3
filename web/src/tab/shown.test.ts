import { expect, test } from "vitest";
import { valueOfHalf } from "./shown";

test("halves are what IEEE 754 says", () => {
  const known: [number, number][] = [
    [0x0000, 0],
    [0x0001, 2 ** -24],
    [0x03ff, 1023 * 2 ** -24],
    [0x0400, 2 ** -14],
    [0x3555, 0.333251953125],
    [0x3c00, 1],
    [0xbc01, -1.0009765625],
    [0xc000, -2],
    [0x7bff, 65504],
  ];
  for (const [half, value] of known) expect(valueOfHalf(half)).toBe(value);
});
