import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { RewardCheck } from "../src/lib/rewardcheck.svelte";
import { Problem, type RewardVerdict } from "../src/api/client";

const verdict = (track: string): RewardVerdict =>
  ({ ok: true, problems: [], situations: [{ name: track }], painting: null, laps: [] }) as unknown as RewardVerdict;

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("of one text about two tracks the later question counts, whichever is answered first", async () => {
  const answers = new Map<string, () => void>();
  const check = new RewardCheck(
    (_, track) => new Promise((resolve) => answers.set(track, () => resolve(verdict(track)))),
  );
  check.ask("return 1.0", "oval");
  await vi.advanceTimersByTimeAsync(500);
  check.ask("return 1.0", "kidney");
  await vi.advanceTimersByTimeAsync(500);
  answers.get("kidney")!();
  await vi.advanceTimersByTimeAsync(0);
  expect(check.verdict).toEqual(verdict("kidney"));
  answers.get("oval")!();
  await vi.advanceTimersByTimeAsync(0);
  expect(check.verdict).toEqual(verdict("kidney"));
});

test("what is wrong with something else than the text marks none of its lines", async () => {
  const gone = () => Promise.reject(new Problem("NotFound", "Track 'mine' does not exist.", "", null, null));
  const check = new RewardCheck(gone);
  check.ask("return 1.0", "mine");
  await vi.advanceTimersByTimeAsync(500);
  expect(check.problems).toMatchObject([{ line: 0, message: "Track 'mine' does not exist." }]);
});

test("an answer about an earlier text does not count", async () => {
  let answer = () => {};
  const check = new RewardCheck((_, track) => new Promise((resolve) => (answer = () => resolve(verdict(track)))));
  check.ask("return 1.0", "oval");
  await vi.advanceTimersByTimeAsync(500);
  check.ask("return 2.0", "oval");
  answer();
  await vi.advanceTimersByTimeAsync(0);
  expect([check.verdict, check.isChecking]).toEqual([undefined, true]);
});

test("what stands in the way of a training is said, of no function as of a wrong one", async () => {
  const wrong = { ...verdict("oval"), ok: false };
  const check = new RewardCheck((text) => Promise.resolve(text === "wrong" ? wrong : verdict("oval")));
  const obstacles = [];
  for (const text of ["", " \n", "wrong", "return 1.0"]) {
    check.ask(text, "oval");
    await vi.advanceTimersByTimeAsync(500);
    obstacles.push([check.obstacle, check.isChecking]);
  }
  expect(obstacles).toEqual([
    ["reward_empty", false],
    ["reward_empty", false],
    ["reward_faulty", false],
    [undefined, false],
  ]);
});
