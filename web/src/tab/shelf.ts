/** Models in this browser's storage, tracks that were drawn, and the best laps of who drives: they stay when the page is closed; a model leaves it
 * only as a download. */
import type { Trace } from "./drivencar";
import type { Sketch } from "../lib/sketch";
import type { Model } from "./model";

const [BASE, VERSION] = ["racecraft-tab", 3];
const KEYS = { models: "name", laps: "key", tracks: "name" } as const; // of what is kept

/** A lap that somebody drove. */
export interface DrivenLap {
  key: string; // track, car and direction
  seconds: number;
  trace: Trace;
}

/** A track that somebody drew. */
export interface DrawnTrack {
  name: string;
  sketch: Sketch;
}

export const drawnTracks = (): Promise<DrawnTrack[]> =>
  ask("tracks", "readonly", (store) => store.getAll() as IDBRequest<DrawnTrack[]>);

export const keepTrack = (track: DrawnTrack): Promise<unknown> =>
  ask("tracks", "readwrite", (store) => store.put(track));

export const dropTrack = (name: string): Promise<unknown> => ask("tracks", "readwrite", (store) => store.delete(name));

/** Every model, newest first. */
export async function kept(): Promise<Model[]> {
  const models = await ask<Model[]>("models", "readonly", (store) => store.getAll());
  return models.sort((a, b) => b.created.localeCompare(a.created));
}

/** Keep a model, instead of one of the same name; an Error with a sentence where there is no room. */
export const keep = (model: Model): Promise<unknown> => ask("models", "readwrite", (store) => store.put(model));

export const drop = (name: string): Promise<unknown> => ask("models", "readwrite", (store) => store.delete(name));

export const drivenLap = (key: string): Promise<DrivenLap | undefined> =>
  ask("laps", "readonly", (store) => store.get(key) as IDBRequest<DrivenLap | undefined>);

export const keepLap = (lap: DrivenLap): Promise<unknown> => ask("laps", "readwrite", (store) => store.put(lap));

async function ask<T>(
  name: keyof typeof KEYS,
  mode: IDBTransactionMode,
  what: (store: IDBObjectStore) => IDBRequest,
): Promise<T> {
  const base = await open();
  try {
    return await new Promise<T>((done, failed) => {
      const transaction = base.transaction(name, mode);
      const request = what(transaction.objectStore(name));
      transaction.oncomplete = () => done(request.result as T);
      transaction.onabort = () => failed(transaction.error ?? new Error("The browser's storage did not answer."));
    });
  } finally {
    base.close();
  }
}

const open = (): Promise<IDBDatabase> =>
  new Promise((done, failed) => {
    const request = indexedDB.open(BASE, VERSION);
    request.onupgradeneeded = () => {
      for (const [name, keyPath] of Object.entries(KEYS))
        if (!request.result.objectStoreNames.contains(name)) request.result.createObjectStore(name, { keyPath });
    };
    request.onsuccess = () => done(request.result);
    request.onerror = () => failed(request.error ?? new Error("This browser keeps nothing."));
  });
