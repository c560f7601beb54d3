/** Models in this browser's storage, tracks that were drawn, and the best laps of who drives: they stay when the page is closed; a model leaves it
 * only as a download. Every tab of the page has the same ones, so what depends on what is there is decided where it is kept, in one transaction. */
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

/** Keep a track; one of the same name only where it is to be replaced, otherwise that is a ConstraintError. */
export const keepTrack = (track: DrawnTrack, isReplacing: boolean): Promise<unknown> =>
  ask("tracks", "readwrite", (store) => (isReplacing ? store.put(track) : store.add(track)));

export const dropTrack = (name: string): Promise<unknown> => ask("tracks", "readwrite", (store) => store.delete(name));

/** Every model, newest first. */
export async function kept(): Promise<Model[]> {
  const models = await ask<Model[]>("models", "readonly", (store) => store.getAll());
  return models.sort((a, b) => b.created.localeCompare(a.created));
}

/** Keep a model, instead of one of the same name; a QuotaExceededError where there is no room. */
export const keep = (model: Model): Promise<unknown> => ask("models", "readwrite", (store) => store.put(model));

/** Keep a model under the first name that is free, and tell which: `nameOf` gives them, from 1; some are `taken` already. */
export const keepNew = (model: Model, nameOf: (number: number) => string, taken: string[]): Promise<string> =>
  ask("models", "readwrite", (store, answer) => {
    const names = store.getAllKeys() as IDBRequest<string[]>;
    names.onsuccess = () => answer(store.put({ ...model, name: freeName(nameOf, [...taken, ...names.result]) }));
    return names;
  });

/** The first of the names that is not taken. */
export function freeName(nameOf: (number: number) => string, taken: string[]): string {
  let number = 1;
  while (taken.includes(nameOf(number))) number++;
  return nameOf(number);
}

export const drop = (name: string): Promise<unknown> => ask("models", "readwrite", (store) => store.delete(name));

/** Keep a model under another name instead of its own; where one has that already, a ConstraintError, and nothing changes. */
export const rename = (model: Model, name: string): Promise<unknown> =>
  ask("models", "readwrite", (store) => {
    store.delete(model.name);
    return store.add({ ...model, name });
  });

export const drivenLap = (key: string): Promise<DrivenLap | undefined> =>
  ask("laps", "readonly", (store) => store.get(key) as IDBRequest<DrivenLap | undefined>);

/** Keep a lap where none is there that is as fast. */
export const keepLap = (lap: DrivenLap): Promise<unknown> =>
  ask("laps", "readwrite", (store, answer) => {
    const before = store.get(lap.key) as IDBRequest<DrivenLap | undefined>;
    before.onsuccess = () => {
      if (!before.result || lap.seconds < before.result.seconds) answer(store.put(lap));
    };
    return before;
  });

/** The browser gives the page no storage at all, as some private windows do. */
export class NothingKept extends Error {
  constructor(cause: unknown) {
    super("This browser keeps nothing.", { cause });
    this.name = "NothingKept";
  }
}
const REFUSALS = ["SecurityError", "InvalidStateError", "UnknownError", "TypeError", "ReferenceError"];
const refused = (error: unknown): never => {
  throw REFUSALS.includes((error as Error).name) ? new NothingKept(error) : error;
};

/** Hear of every change, of this tab or another one. */
export function onChange(listener: () => void): void {
  new BroadcastChannel(BASE).onmessage = listener;
}

function tellTabs(): void {
  const channel = new BroadcastChannel(BASE);
  channel.postMessage("changed");
  channel.close();
}

/** `what` asks the store; its answer is that of the request which it returns, or gives to `answer` later. */
async function ask<T>(
  name: keyof typeof KEYS,
  mode: IDBTransactionMode,
  what: (store: IDBObjectStore, answer: (request: IDBRequest) => void) => IDBRequest,
): Promise<T> {
  const base = await open().catch(refused);
  try {
    return await new Promise<T>((done, failed) => {
      const transaction = base.transaction(name, mode);
      let request = what(transaction.objectStore(name), (last) => (request = last));
      transaction.oncomplete = () => done(request.result as T);
      transaction.onabort = () => failed(transaction.error ?? new Error("The browser's storage did not answer."));
    });
  } finally {
    base.close();
    if (mode === "readwrite") tellTabs();
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
    request.onerror = () => failed(request.error ?? new NothingKept(undefined));
  });
