/** A quiz as it is answered: the first answer to each question counts. */
import type { Question } from "./desk";

/** Index of the right choice. */
export const rightOf = (question: Question): number => question.choices.findIndex((choice) => choice.right);

/** How many of the first answers are right; an unanswered question is not. */
export const rights = (questions: Question[], answers: (number | undefined)[]): number =>
  questions.filter((question, index) => answers[index] === rightOf(question)).length;
