/** The lessons of a site: files beside the page, and progress that stays in this browser. */
import type { Desk, LessonFacts, LessonPage, LessonProgress } from "../desk";
import { remembered, store } from "./studies";

/** Lessons below `site`, the address of its folder; `python -m racecraft.site` writes their files. */
export function siteDesk(site: string): Desk {
  const read = async <T>(name: string): Promise<T> => {
    const answer = await fetch(new URL(`lessons/${name}`, site));
    if (!answer.ok) throw new Error(`${name}: ${answer.status} ${answer.statusText}`);
    return (await answer.json()) as T;
  };
  const index = () => read<LessonFacts[]>("index.json");
  return {
    async list() {
      const studies = remembered();
      return (await index()).map((facts) => ({ facts, progress: studies[facts.number] ?? NOTHING }));
    },
    async lesson(number) {
      const facts = (await index()).find((one) => one.number === number);
      if (!facts) throw new Error(`There is no lesson ${number}.`);
      return read<LessonPage>(`${facts.name}.json`);
    },
    record: (lesson, step, share) => Promise.resolve(store(lesson.number, step, share)),
    picture: (lesson, name, language) =>
      new URL(`lessons/${language === "en" ? "" : `${language}/`}${lesson.name}/${name}.webp`, site).href,
    href: (number) => (number === undefined ? "#" : `#${number}`),
  };
}

const NOTHING: LessonProgress = { is_read: false, quiz: null, solved: [] };
