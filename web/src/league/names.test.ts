import { expect, test } from "vitest";
import { authorOf, carsShown, isUnnamed, namesShown } from "./names";

test("nobody reads that they wrote themselves what their teacher said", () => {
  expect(authorOf({ author: "you", is_mine: true })).toBe("you");
  expect(authorOf({ author: "you", is_mine: false })).toBe("from who organises the group");
  expect(authorOf({ author: "Ms Frizzle", is_mine: false })).toBe("Ms Frizzle");
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
    cars: [
      { model: "you", laps: [7] },
      { model: "Comet", laps: [] },
    ],
  });
  expect(film).toEqual({
    trial: 2,
    cars: [
      { model: "no name yet", laps: [7] },
      { model: "Comet", laps: [] },
    ],
  });
});
