import { expect, test } from "vitest";
import { absenceOf, entryOf, standingOf } from "./standing";

test("who leads is told that, and who follows how far behind and ahead of how many, in whole per cent", () => {
  expect(standingOf({ place: 1, gap: 0 }, 100)).toBe("You lead.");
  expect(standingOf({ place: 3, gap: 4.8 }, 33.3)).toMatch(
    /^4\.80.s behind the first · faster than 33.% of the others$/,
  );
  expect(standingOf({ place: 4, gap: 5 }, 0)).toMatch(/^5\.00.s behind the first$/);
  expect(standingOf({ place: null, gap: null }, null)).toBe("too few laps to be ranked");
});

test("who is on no board is told whether that is because of who holds the race", () => {
  const [stands, out] = [{ disqualified: "" }, { disqualified: "Driven by hand." }];
  expect(absenceOf([])).toBe("Not in the race yet");
  expect(absenceOf([out, stands])).toBe("Not in the race yet");
  expect(absenceOf([out, out])).toContain("Taken out");
});

test("nobody is told to enter as often as they like where a day has a limit or the race is not open", () => {
  const race = { opens: "2026-12-04T12:00:00Z", attempts_per_day: 0 };
  expect(entryOf({ ...race, state: "open" })).toContain("as often as you like");
  expect(entryOf({ ...race, state: "open", attempts_per_day: 1 })).toContain("1 entry a day");
  expect(entryOf({ ...race, state: "open", attempts_per_day: 3 })).toContain("3 entries a day");
  expect(entryOf({ ...race, state: "upcoming" })).toContain("2026");
  expect(entryOf({ ...race, state: "closed", attempts_per_day: 3 })).toBe("The race is over: nobody enters any more.");
});
