/** Small things that a browser keeps, as text. Where it keeps nothing, or is full, a page works all the same and begins anew the next time. */

/** What a store says of a key; null where there is nothing, or no store. */
function read(store: () => Storage, key: string): string | null {
  try {
    return store().getItem(key);
  } catch {
    return null;
  }
}

/** Keep it, or with null forget it; false where that was not possible. */
function write(store: () => Storage, key: string, text: string | null): boolean {
  try {
    if (text === null) store().removeItem(key);
    else store().setItem(key, text);
    return true;
  } catch {
    return false;
  }
}

const remembered = (store: () => Storage) => ({
  read: (key: string) => read(store, key),
  write: (key: string, text: string | null) => write(store, key, text),
});

/** Stays when the page is closed, and is every tab's. */
export const browser = remembered(() => localStorage);

/** Is this tab's alone, and stays until it is closed. */
export const tab = remembered(() => sessionStorage);
