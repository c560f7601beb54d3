/** A training that is under way, as its tab notes it: the page that comes after one which was closed, reloaded or taken away meanwhile tells of it.
 *
 *     note ──the tab's next page──▶ cutShort
 *      └─ leave, as the page goes ──another tab, where this one is gone for good──▶ cutShort
 */
import { browser, tab } from "../lib/remembered";
import type { Model } from "./model";

/** What was asked for, and what of it has been kept. */
export interface Underway extends Pick<Model, "track" | "reward" | "space" | "race"> {
  id: string;
  name: string | undefined; // of the model that was kept last
  seconds: number; // of learning behind that
}

const KEY = "racecraft-tab-training";
const PATIENCE = 3000; // ms until the page before is gone
let held: { id: string; letGo: () => void } | undefined;

/** It goes on, or with undefined is over. */
export function note(training: Underway | undefined): void {
  tab.write(KEY, training ? JSON.stringify(training) : null);
  if (held?.id === training?.id) return;
  held?.letGo();
  held = undefined;
  if (!training) return;
  const { id } = training;
  const over = new Promise<void>((letGo) => (held = { id, letGo }));
  void navigator.locks?.request(KEY + id, () => over); // so that a tab which is a copy of this one knows that it goes on
}

/** The page goes, and its tab perhaps with it. */
export const leave = (): void => void browser.write(KEY, tab.read(KEY));

/** It is there again as it was. */
export const comeBack = (): void => void browser.write(KEY, null);

/** A training over which its page was closed; that is told once. */
export async function cutShort(): Promise<Underway | undefined> {
  const text = tab.read(KEY) ?? browser.read(KEY);
  tab.write(KEY, null);
  browser.write(KEY, null);
  const found = text === null ? undefined : read(text);
  return found && (await isOver(found)) ? found : undefined;
}

function read(text: string): Underway | undefined {
  try {
    const found = JSON.parse(text) as Underway;
    return [found.id, found.track, found.reward].every((one) => typeof one === "string") ? found : undefined;
  } catch {
    return undefined; // of another program at this address, say
  }
}

/** Browsers know of other pages where they trust the address; elsewhere there is none to be asked. */
const isOver = async ({ id }: Underway): Promise<boolean> =>
  (await navigator.locks
    ?.request(KEY + id, { signal: AbortSignal.timeout(PATIENCE) }, () => true)
    .catch(() => false)) ?? true;
