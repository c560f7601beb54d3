import { expect, test } from "vitest";
import { crowdOf } from "./state";

test("nobody is said to drive where nobody does, as in a race that is over", () => {
  expect(crowdOf({ entrants: 12, running: 3 })).toBe("12 in the race · 3 driving");
  expect(crowdOf({ entrants: 12, running: 0 })).toBe("12 in the race");
});
