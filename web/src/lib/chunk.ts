/** Parts of the console that are loaded when they are needed. One that cannot be is loaded with the whole page, once the
 * console answers again: a browser does not ask twice for a module that failed. */
import { back, connection, probe } from "./connection.svelte";

const KEY = "racecraft-reloaded";
const OFTEN = 10_000; // ms; a part that still is missing then is not worth another time

export async function chunk<T>(load: () => Promise<T>): Promise<T> {
  try {
    return await load();
  } catch (error) {
    await probe();
    if (connection.lostAt) await back();
    const last = Number(sessionStorage.getItem(KEY) ?? 0);
    if (Date.now() - last > OFTEN) {
      sessionStorage.setItem(KEY, String(Date.now()));
      location.reload();
      return new Promise(() => {}); // until then
    }
    throw error;
  }
}
