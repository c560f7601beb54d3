import { beforeEach, expect, test, vi } from "vitest";

const { Problem } = vi.hoisted(() => ({
  Problem: class extends Error {
    constructor(readonly code: string) {
      super(code);
    }
  },
}));
let isBack: () => void = () => undefined;
vi.mock("../api/client", () => ({ Problem }));
vi.mock("../lib/connection.svelte", () => ({ back: () => new Promise<void>((resolve) => (isBack = resolve)) }));

const kept = new Map<string, string>();
let isFull = false;
vi.mock("../lib/remembered", () => ({
  browser: {
    read: (key: string) => kept.get(key) ?? null,
    write: (key: string, text: string | null) => {
      if (isFull) return false;
      if (text === null) kept.delete(key);
      else kept.set(key, text);
      return true;
    },
  },
}));

const { keep, sendAll, unsentOf } = await import("./unsent");

const PROGRESS = { is_read: true, quiz: 1, solved: [] };
const answered = (person: number, lesson: number) => ({ person, lesson, step: { answers: [1, 0], is_read: true } });
let sent: number[];
const send = (lesson: number) => {
  sent.push(lesson);
  return Promise.resolve(PROGRESS);
};

beforeEach(async () => {
  isFull = false;
  sent = [];
  await Promise.all([7, 8].map((person) => sendAll(person, send)));
  kept.clear();
  sent = [];
});

test("what was kept is sent in order and once, and of nobody else", async () => {
  for (const one of [answered(7, 3), answered(8, 1), answered(7, 4), answered(7, 3)]) keep(one);
  await sendAll(7, send);
  expect(sent).toEqual([4, 3]);
  expect(unsentOf(7)).toEqual([]);
  expect(unsentOf(8)).toEqual([answered(8, 1)]);
});

test("who is asked while the console does not answer waits, and sends then", async () => {
  keep(answered(7, 3));
  let isThere = false;
  const all = sendAll(7, (lesson) => (isThere ? send(lesson) : Promise.reject(new Problem("Offline"))));
  await new Promise((resolve) => setTimeout(resolve));
  expect(unsentOf(7)).toHaveLength(1);
  isThere = true;
  isBack();
  await all;
  expect(sent).toEqual([3]);
});

test("who was signed out meanwhile keeps it; what is refused for good goes", async () => {
  keep(answered(7, 3));
  await sendAll(7, () => Promise.reject(new Problem("NotSignedIn")));
  expect(unsentOf(7)).toHaveLength(1);
  await sendAll(7, () => Promise.reject(new Problem("Conflict")));
  expect(unsentOf(7)).toEqual([]);
});

test("a full browser keeps it as long as the page is open, and what is no list counts as nothing", async () => {
  kept.set("racecraft-unsent-lessons", '{"a": 1}');
  expect(unsentOf(7)).toEqual([]);
  isFull = true;
  keep(answered(7, 3));
  expect(unsentOf(7)).toHaveLength(1);
  await sendAll(7, send);
  expect(sent).toEqual([3]);
  expect(unsentOf(7)).toEqual([]);
});
