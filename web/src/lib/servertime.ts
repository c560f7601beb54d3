/** What time it is by the server's clock, by which it says when something began: this computer's may be wrong by a day. */

const SAME = 5000; // ms: an answer tells its second alone, and was under way
let ahead = 0; // ms that the server's clock is ahead of this one

/** An answer was sent at this moment, as its header says it. */
export function sentAt(date: string | null): void {
  const found = Date.parse(date ?? "") - Date.now();
  if (!Number.isNaN(found)) ahead = Math.abs(found) > SAME ? found : 0;
}

/** ms. */
export const serverNow = (): number => Date.now() + ahead;
