/** What people are called where the server knows no name of theirs. */
import type { CommentInfo } from "./api";
import { l } from "./text";
import type { Me } from "./who.svelte";

const UNNAMED = "you"; // whose console it was before it became a league
const GONE = /^\(gone (\d+)\)$/; // as the server calls who has deleted their account
const WITHDRAWN = "Withdrawn by its owner.";

/** What others read where somebody stands by name, on a board say. */
export const nameShown = (name: string): string => {
  const [, number] = GONE.exec(name) ?? [];
  return number ? l("person_gone", { number }) : name === UNNAMED ? l("unnamed") : name;
};

/** Who did something, for whoever holds the league. */
export const doerOf = (name: string, me: Pick<Me, "name"> | null | undefined): string =>
  name === UNNAMED && me?.name === UNNAMED ? l("comment_by_me") : nameShown(name);

/** Whether an entry is out as its owner has deleted their account, so that nobody lets it in again. */
export const isWithdrawn = (reason: string): boolean => reason === WITHDRAWN;

/** Why an entry does not count: who organises says so, or the server of who has deleted their account. */
export const reasonShown = (reason: string): string => (isWithdrawn(reason) ? l("withdrawn") : reason);

/** The same of all in a list. */
export const namesShown = <T extends { name: string }>(people: T[]): T[] =>
  people.map((one) => ({ ...one, name: nameShown(one.name) }));

/** The same of the cars of a film, which are called by who entered them. */
type Called = { model: string };
const calledShown = <C extends Called>(cars: C[]): C[] => cars.map((car) => ({ ...car, model: nameShown(car.model) }));
export const carsShown = <C extends Called, M extends Called, T>(film: T & { cars: C[]; missing: M[] }): T => ({
  ...film,
  cars: calledShown(film.cars),
  missing: calledShown(film.missing),
});

/** Whether somebody holds the league under no name of their own. */
export const isUnnamed = (me: Pick<Me, "name" | "role"> | null | undefined): boolean =>
  me?.role === "admin" && me.name === UNNAMED;

/** Who said something about a model: only organisers do. */
export const authorOf = (one: Pick<CommentInfo, "author" | "is_mine">): string =>
  one.is_mine ? l("comment_by_me") : one.author === UNNAMED ? l("comment_by_organiser") : nameShown(one.author);
