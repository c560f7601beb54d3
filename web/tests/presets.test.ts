import { expect, it } from "vitest";
import { de } from "../src/i18n/de";
import { en, type Key } from "../src/i18n/en";

it("no card of a preset has the server's word for a name in German", () => {
  const names = (Object.keys(en) as Key[]).filter((key) => /^(preset|space)_name_/.test(key));
  expect(names.length).toBeGreaterThan(15);
  expect(names.filter((key) => de[key] === en[key])).toEqual([]);
});
