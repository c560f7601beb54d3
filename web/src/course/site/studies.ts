/** Which lessons were read in this browser, and how well their questions were answered. */
import { browser } from "../../lib/remembered";
import type { LessonProgress, Step } from "../desk";

const STORE = "racecraft-lessons";
type Studies = Record<number, LessonProgress>;
let unkept: Studies = {}; // where the browser keeps nothing: as long as the page is open

/** By the lesson's number; what was not begun is not there, and what is damaged is forgotten. */
export function remembered(): Studies {
  let found: unknown;
  try {
    found = JSON.parse(localStorage.getItem(STORE) ?? "{}");
  } catch {
    return unkept;
  }
  const studies: Studies = {};
  for (const [number, kept] of Object.entries(found ?? {})) {
    const { is_read, quiz } = (kept ?? {}) as Partial<LessonProgress>;
    const share = typeof quiz === "number" && quiz >= 0 && quiz <= 1 ? quiz : null;
    studies[Number(number)] = { is_read: is_read === true, quiz: share, solved: [] };
  }
  return { ...studies, ...unkept }; // which is newer
}

/** Keep a step; what was done before stays, of quizzes the best. */
export function store(number: number, step: Step, share?: number): LessonProgress {
  const studies = remembered();
  const before = studies[number];
  const quiz = share === undefined ? (before?.quiz ?? null) : Math.max(share, before?.quiz ?? 0);
  const now = { is_read: Boolean(step.is_read || before?.is_read), quiz, solved: [] };
  const all = { ...studies, [number]: now };
  unkept = browser.write(STORE, JSON.stringify(all)) ? {} : { ...unkept, [number]: now };
  return now;
}
