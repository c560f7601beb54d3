/** Models in this browser's storage: they stay when the page is closed, and leave it only as a download. */
import type { Model } from "./model";

const [BASE, MODELS] = ["racecraft-tab", "models"];

/** Everything kept, newest first. */
export async function kept(): Promise<Model[]> {
  const models = await ask<Model[]>("readonly", (store) => store.getAll());
  return models.sort((a, b) => b.created.localeCompare(a.created));
}

/** Keep a model, instead of one of the same name; an Error with a sentence where there is no room. */
export const keep = (model: Model): Promise<unknown> => ask("readwrite", (store) => store.put(model));

export const drop = (name: string): Promise<unknown> => ask("readwrite", (store) => store.delete(name));

async function ask<T>(mode: IDBTransactionMode, what: (store: IDBObjectStore) => IDBRequest): Promise<T> {
  const base = await open();
  try {
    return await new Promise<T>((done, failed) => {
      const transaction = base.transaction(MODELS, mode);
      const request = what(transaction.objectStore(MODELS));
      transaction.oncomplete = () => done(request.result as T);
      transaction.onabort = () => failed(transaction.error ?? new Error("The browser's storage did not answer."));
    });
  } finally {
    base.close();
  }
}

const open = (): Promise<IDBDatabase> =>
  new Promise((done, failed) => {
    const request = indexedDB.open(BASE, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(MODELS, { keyPath: "name" });
    request.onsuccess = () => done(request.result);
    request.onerror = () => failed(request.error ?? new Error("This browser keeps nothing."));
  });
