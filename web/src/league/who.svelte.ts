/** Whether this console is a league's, and who is signed in; all that the pages of one person load of a league. */
import { ask } from "../api/client";
import type { components } from "../api/schema";
import { connection } from "../lib/connection.svelte";

export type Me = components["schemas"]["Me"];

export const isLeague = document.querySelector('meta[name="rooms"]')?.getAttribute("content") === "league";

/** `me` is null for a stranger, undefined until the server has said it; `provider` is empty where there is none. */
export const who = $state<{ me: Me | null | undefined; provider: string }>({ me: undefined, provider: "" });

export async function askWho(): Promise<void> {
  const door = await ask<components["schemas"]["Door"]>("GET", "/door");
  who.provider = door.provider ?? "";
  who.me = door.me;
}

/** The browser was let in. */
export function enter(me: Me): void {
  who.me = me;
  connection.isStranger = false;
}

/** Pages of a league that are part of the console. */
const ROOMS = ["league", "groups", "me"];

export const isRoom = (parts: string[]): boolean => isLeague && ROOMS.includes(parts[0] ?? "");

/** Pages that stand alone, without the console around them: the door, and what a projector shows. */
export const isAlone = (parts: string[]): boolean =>
  isLeague &&
  (!who.me ||
    connection.isStranger ||
    ["card", "join", "reset", "oidc"].includes(parts[0] ?? "") ||
    parts[2] === "screen");
