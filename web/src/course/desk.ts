/** Where lessons come from and where progress is kept: a console, or a site that has no server. */
import { ask, Problem } from "../api/client";
import type { components } from "../api/schema";
import type { Language } from "../i18n/index.svelte";
import { who } from "../league/who.svelte";
import { say } from "../lib/toasts.svelte";
import { c } from "./text";
import { keep, sendAll, unsentOf } from "./unsent";

type Schemas = components["schemas"];
export type LessonFacts = Schemas["LessonFacts"];
export type LessonPage = Schemas["LessonPage"];
export type LessonProgress = Schemas["LessonProgress"];
export type LessonCard = Schemas["LessonCard"];
export type PageCell = Schemas["PageCell"];
export type Question = Schemas["Question"];

export interface Step {
  is_read?: boolean;
  answers?: number[];
}

export interface Desk {
  list(): Promise<LessonCard[]>;
  lesson(number: number): Promise<LessonPage>;
  record(lesson: LessonFacts, step: Step, share?: number): Promise<LessonProgress>;
  /** Address of a picture with words of a language. */
  picture(lesson: LessonFacts, name: string, language: Language): string;
  /** Address of a lesson's page, or without a number of the course's. */
  href(number?: number): string;
}

const send = (lesson: number, step: Step) => ask<LessonProgress>("PUT", `/lessons/${lesson}/progress`, step);
/** Whose steps are kept: of a console that is no league's there is one person. */
const person = () => who.me?.id ?? 0;

/** What was read and answered without a console, by whoever is here now. */
export const sendKept = (): Promise<void> => sendAll(person(), send);

export const consoleDesk: Desk = {
  list: async () => {
    await sendKept();
    return ask<LessonCard[]>("GET", "/lessons");
  },
  lesson: (number) => ask<LessonPage>("GET", `/lessons/${number}`),
  record: async (lesson, step) => {
    try {
      return await send(lesson.number, step);
    } catch (error) {
      if (!(error instanceof Problem && error.code === "Offline")) throw error;
      if (unsentOf(person()).length === 0) say(c("kept_unsent")); // once is enough
      keep({ person: person(), lesson: lesson.number, step });
      await sendKept();
      return await send(lesson.number, {}); // nothing more: what there is now
    }
  },
  picture: (lesson, name, language) => `/api/lessons/${lesson.number}/pictures/${name}?language=${language}`,
  href: (number) => (number === undefined ? "/lessons" : `/lessons/${number}`),
};
