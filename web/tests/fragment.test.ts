import { expect, test } from "vitest";
import { fragmentOf } from "../src/lib/fragment";

test("what stands behind # is read, and a page comes up where it cannot be", () => {
  expect(fragmentOf("")).toBe("");
  expect(fragmentOf("#a%20b")).toBe("a b");
  expect(fragmentOf("#%E0%A4%A")).toBe("");
});
