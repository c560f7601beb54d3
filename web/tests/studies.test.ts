/** What a reader of the site's lessons has done, in a browser whose storage is full. */
import { afterAll, expect, test, vi } from "vitest";
import { remembered, store } from "../src/course/site/studies";

const before = globalThis.localStorage;
afterAll(() => void vi.stubGlobal("localStorage", before));

test("what a full browser cannot keep counts as long as the page is open, and is kept once there is room", () => {
  const kept = new Map<string, string>();
  let isFull = false;
  vi.stubGlobal("localStorage", {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, text: string) => {
      if (isFull) throw new DOMException("full", "QuotaExceededError");
      kept.set(key, text);
    },
  });
  store(5, { is_read: true });
  isFull = true;
  expect(store(5, { answers: [0] }, 1)).toMatchObject({ is_read: true, quiz: 1 });
  store(6, { is_read: true });
  expect(remembered()).toMatchObject({ 5: { is_read: true, quiz: 1 }, 6: { is_read: true } });
  isFull = false;
  store(7, { is_read: true });
  const stored = JSON.parse([...kept.values()][0]!) as unknown;
  expect(stored).toMatchObject({ 5: { is_read: true, quiz: 1 }, 6: { is_read: true }, 7: { is_read: true } });
});
