/**
 * What somebody has read and answered while the console did not answer: kept in the browser, and sent when it does.
 *
 *     record ──no answer──▶ kept, also past the page's end ──console is back, or a page opens──▶ sent, then gone from here
 *
 * Whoever else signs in at this browser meanwhile sends nothing of it. To send the same twice changes nothing: the server
 * keeps the best.
 */
import { Problem } from "../api/client";
import { back } from "../lib/connection.svelte";
import { browser } from "../lib/remembered";
import type { LessonProgress, Step } from "./desk";

export interface Unsent {
  person: number;
  lesson: number;
  step: Step;
}
export type Send = (lesson: number, step: Step) => Promise<LessonProgress>;

const KEY = "racecraft-unsent-lessons";
const MOST = 100;
const FOR_GOOD = ["NotFound", "Conflict", "InvalidRequest"]; // refusals that come again
let held: Unsent[] = []; // of a browser that keeps nothing, or is full
let sending: Promise<void> | undefined;

const same = (one: Unsent, other: Unsent) => JSON.stringify(one) === JSON.stringify(other);

function isUnsent(one: unknown): one is Unsent {
  const { person, lesson, step } = (one ?? {}) as Partial<Unsent>;
  return Number.isInteger(person) && Number.isInteger(lesson) && typeof step === "object" && step !== null;
}

function all(): Unsent[] {
  let kept: unknown = [];
  try {
    kept = JSON.parse(browser.read(KEY) ?? "[]");
  } catch {
    // of another program at this address, say
  }
  const found = Array.isArray(kept) ? kept.filter(isUnsent) : [];
  return [...found, ...held.filter((one) => !found.some((other) => same(one, other)))];
}

function put(wanted: Unsent[]): void {
  held = browser.write(KEY, wanted.length ? JSON.stringify(wanted) : null) ? [] : wanted;
}

export const unsentOf = (person: number): Unsent[] => all().filter((one) => one.person === person);

export function keep(fresh: Unsent): void {
  put([...all().filter((one) => !same(one, fresh)), fresh].slice(-MOST));
}

/** Send what is kept of somebody; comes when all of it is, however long the console does not answer. */
export function sendAll(person: number, send: Send): Promise<void> {
  sending ??= deliver(person, send).finally(() => (sending = undefined));
  return sending;
}

async function deliver(person: number, send: Send): Promise<void> {
  for (let one = unsentOf(person)[0]; one; one = unsentOf(person)[0]) {
    const tried = one;
    try {
      await send(tried.lesson, tried.step);
    } catch (error) {
      if (error instanceof Problem && error.code === "Offline") {
        await back();
        continue;
      }
      if (!(error instanceof Problem && FOR_GOOD.includes(error.code))) return; // who is signed out comes back
    }
    put(all().filter((other) => !same(other, tried)));
  }
}
