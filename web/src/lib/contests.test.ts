import { expect, test } from "vitest";
import type { ContestCard } from "../api/contests";
import { moment } from "./dates";
import { startOf, toldGhost } from "./contests";

test("the button that starts a heat says why it starts none", () => {
  expect([0, 1].map((count) => startOf("heat", count))).toEqual(Array(2).fill("Choose two or more models"));
  expect(startOf("heat", 8)).toBe("Start the heat with 8");
  expect(startOf("heat", 9)).toBe("A heat takes 8 at most");
  expect(startOf("ladder", 9)).toBe("Start the ladder of 9");
  expect(startOf("ladder", 21)).toBe("A ladder takes 20 at most");
});

test("a ghost of an earlier heat is told with the heat, also of several of one name", () => {
  const [first, second] = ["2026-11-28T10:00:00Z", "2026-11-28T11:00:00Z"];
  const heats = [
    { id: "a", title: "", models: ["ada", "bob"], is_ladder: false, created: first },
    { id: "b", title: "", models: ["ada", "bob"], is_ladder: false, created: second },
  ] as ContestCard[];
  const told = ["a", "b", "c"].map((heat) => toldGhost({ heat }, heats));
  expect(told).toEqual([
    `The best car of the heat ada – bob (${moment(first)})`,
    `The best car of the heat ada – bob (${moment(second)})`,
    "The best car of an earlier heat that has been deleted",
  ]);
  expect(toldGhost("best-lap", heats)).toBe("The fastest lap, again with every lap");
});
