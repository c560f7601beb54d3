/** What people are called where the server knows no name of theirs. */
import type { CommentInfo } from "./api";
import { l } from "./text";
import type { Me } from "./who.svelte";

const UNNAMED = "you"; // whose console it was before it became a league

/** Whether somebody holds the league under no name of their own. */
export const isUnnamed = (me: Pick<Me, "name" | "role"> | null | undefined): boolean =>
  me?.role === "admin" && me.name === UNNAMED;

/** Who said something about a model: only organisers do. */
export const authorOf = (one: Pick<CommentInfo, "author" | "is_mine">): string =>
  one.is_mine ? l("comment_by_me") : one.author === UNNAMED ? l("comment_by_organiser") : one.author;
