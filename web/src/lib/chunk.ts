/** Parts of the pages that are loaded when they are needed. One that could not be fetched is loaded with the whole page, once the server answers
 * again: a browser does not ask twice for a module that failed. One that is broken is no better after that, and says so. */
import { t } from "../i18n/index.svelte";
import { back, connection, probe } from "./connection.svelte";
import { tab } from "./remembered";
import { fail } from "./toasts.svelte";

const KEY = "racecraft-reloaded";
const OFTEN = 10_000; // ms; a part that still is missing then is not worth another time

/** What browsers say of a module that did not come (Chromium, Firefox, WebKit), and Vite of its style sheet; all else was thrown by the module. */
const MISSING = /dynamically imported module|^Importing a module script failed|^Unable to preload CSS/;

/** `mayReload`: the page has nothing that would be lost. */
export async function chunk<T>(load: () => Promise<T>, mayReload = true): Promise<T> {
  try {
    return await load();
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    const isMissing = MISSING.test(why);
    if (isMissing && mayReload) {
      await probe();
      if (connection.lostAt) await back();
      const isLate = Date.now() - Number(tab.read(KEY) ?? 0) > OFTEN;
      if (isLate && tab.write(KEY, String(Date.now()))) {
        location.reload();
        return new Promise(() => {}); // until then
      }
    }
    fail(new Error(t(isMissing ? "part_missing" : "part_broken", { why })));
    return new Promise(() => {}); // what waits for it stays away, the page around it goes on
  }
}
