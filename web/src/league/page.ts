/** Pages that a stranger sees for themselves, and not the door in their place. */
const isForStrangers = ([room = "", name = ""]: string[]): boolean =>
  ["card", "join", "reset", "oidc"].includes(room) || (room === "league" && name !== "" && name !== "audit");

/** What is one page, and stays as it is while its name does: the door is one wherever a stranger meets it, as the address
 *  may change behind it when the answer to a sign-out comes. */
export const pageOf = (parts: string[], isStranger: boolean): string =>
  isStranger && !isForStrangers(parts) ? "door" : `/${parts.join("/")}`;
