import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { chunk } from "../src/lib/chunk";
import { toasts } from "../src/lib/toasts.svelte";

const MISSING = new TypeError("Failed to fetch dynamically imported module: http://here/part.js");
const failing = (error: Error) => () => Promise.reject(error);
const settled = () => new Promise((go) => setTimeout(go, 5));

let reloads = 0;
let asked = 0;
const kept = new Map<string, string>();

beforeEach(() => {
  [reloads, asked] = [0, 0];
  kept.clear();
  toasts.length = 0;
  vi.stubGlobal("location", { reload: () => reloads++ });
  vi.stubGlobal("fetch", () => Promise.resolve(++asked));
  vi.stubGlobal("sessionStorage", {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, text: string) => kept.set(key, text),
  });
});
afterEach(() => vi.unstubAllGlobals());

test("what did not come is loaded with the whole page, but not again and again", async () => {
  void chunk(failing(MISSING));
  await settled();
  void chunk(failing(MISSING));
  await settled();
  expect(reloads).toBe(1);
  expect(toasts.map(({ text }) => text)).toEqual([expect.stringContaining("did not come")]);
});

test("what is broken says so, and neither asks the server nor loads the page again", async () => {
  void chunk(failing(new TypeError("x is not a function")));
  await settled();
  expect([reloads, asked]).toEqual([0, 0]);
  expect(toasts.map(({ text }) => text)).toEqual([expect.stringContaining("x is not a function")]);
});

test("a page with something to lose, or that cannot remember, stays", async () => {
  void chunk(failing(MISSING), false);
  await settled();
  expect([reloads, asked]).toEqual([0, 0]);
  vi.stubGlobal("sessionStorage", undefined);
  void chunk(failing(MISSING));
  await settled();
  expect([reloads, asked]).toEqual([0, 1]);
});
