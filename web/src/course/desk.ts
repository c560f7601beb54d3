/** Where lessons come from and where progress is kept: a console, or a site that has no server. */
import { ask } from "../api/client";
import type { components } from "../api/schema";
import type { Language } from "../i18n/index.svelte";

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

export const consoleDesk: Desk = {
  list: () => ask<LessonCard[]>("GET", "/lessons"),
  lesson: (number) => ask<LessonPage>("GET", `/lessons/${number}`),
  record: (lesson, step) => ask<LessonProgress>("PUT", `/lessons/${lesson.number}/progress`, step),
  picture: (lesson, name, language) => `/api/lessons/${lesson.number}/pictures/${name}?language=${language}`,
  href: (number) => (number === undefined ? "/lessons" : `/lessons/${number}`),
};
