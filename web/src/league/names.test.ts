import { expect, test } from "vitest";
import { authorOf, carsShown, doerOf, isUnnamed, nameShown, namesShown, reasonShown } from "./names";

test("nobody reads that they wrote themselves what their teacher said", () => {
  expect(authorOf({ author: "you", is_mine: true })).toBe("you");
  expect(authorOf({ author: "you", is_mine: false })).toBe("from who organises the group");
  expect(authorOf({ author: "Ms Frizzle", is_mine: false })).toBe("Ms Frizzle");
  expect(authorOf({ author: "(gone 3)", is_mine: false })).toBe("deleted account 3");
});

test("who holds the league is asked for a name, and nobody else", () => {
  expect(isUnnamed({ name: "you", role: "admin" })).toBe(true);
  expect(
    [{ name: "Ms Frizzle", role: "admin" } as const, { name: "you", role: "racer" } as const, null].map(isUnnamed),
  ).toEqual([false, false, false]);
});

test("nobody reads “you” where somebody stands who has no name yet", () => {
  const rows = namesShown([
    { name: "you", place: 1 },
    { name: "Comet", place: 2 },
  ]);
  expect(rows).toEqual([
    { name: "no name yet", place: 1 },
    { name: "Comet", place: 2 },
  ]);
  const film = carsShown({
    trial: 2,
    cars: [{ model: "Comet", laps: [7] }],
    missing: [{ model: "you", entry: 4 }],
  });
  expect(film).toEqual({
    trial: 2,
    cars: [{ model: "Comet", laps: [7] }],
    missing: [{ model: "no name yet", entry: 4 }],
  });
});

test("who has deleted their account is said to have, in words of the page", () => {
  expect(nameShown("(gone 14)")).toBe("deleted account 14");
  expect(nameShown("Rocket (gone 14)")).toBe("Rocket (gone 14)");
  expect(reasonShown("Withdrawn by its owner.")).toBe("The account was deleted.");
  expect(reasonShown("Driven by hand.")).toBe("Driven by hand.");
});

test("who holds the league reads of themselves what they did", () => {
  expect(doerOf("you", { name: "you" })).toBe("you");
  expect(doerOf("you", { name: "Comet" })).toBe("no name yet");
  expect(doerOf("(gone 3)", { name: "you" })).toBe("deleted account 3");
  expect(doerOf("", { name: "you" })).toBe("");
});
