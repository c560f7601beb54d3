import { expect, test } from "vitest";
import { pageOf } from "./page";

test("the door stays one while the address changes behind it", () => {
  for (const parts of [["me"], ["league"], ["league", "audit"], ["groups", "3"], []])
    expect(pageOf(parts, true)).toBe("door");
});

test("what strangers may see, and all that others see, is a page by its address", () => {
  for (const parts of [["league", "3"], ["league", "3", "screen"], ["join"], ["card"], ["reset"], ["oidc"]])
    expect(pageOf(parts, true)).toBe(`/${parts.join("/")}`);
  for (const parts of [["me"], ["league"], ["league", "audit"], ["groups", "3"]])
    expect(pageOf(parts, false)).toBe(`/${parts.join("/")}`);
});
