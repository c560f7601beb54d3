/** Models of a tab whose browser gives it no storage: they are there as long as the page is open. */
import { afterAll, expect, test, vi } from "vitest";
import { Garage } from "../src/tab/garage.svelte";
import type { Model } from "../src/tab/model";
import { NothingKept } from "../src/tab/shelf";
import { why } from "../src/tab/text";

const before = [globalThis.BroadcastChannel, globalThis.indexedDB] as const;
afterAll(() => {
  vi.stubGlobal("BroadcastChannel", before[0]);
  vi.stubGlobal("indexedDB", before[1]);
});
vi.stubGlobal(
  "BroadcastChannel",
  class {
    postMessage = () => undefined;
    close = () => undefined;
  },
);

const model = (created: string) => ({ name: "", created }) as Model;
const names = (garage: Garage) => garage.models.map(({ name }) => name);
const nameOf = (number: number) => `oval-${number}`;

test.each([
  () => {
    throw new DOMException("The operation is insecure.", "SecurityError");
  },
  () => {
    const request = { error: new DOMException("mutations are not allowed", "InvalidStateError") };
    setTimeout(() => (request as unknown as { onerror: () => void }).onerror());
    return request;
  },
])("where nothing is kept models are named, deleted and brought back all the same", async (open) => {
  vi.stubGlobal("indexedDB", { open });
  const told: string[] = [];
  const garage = new Garage((error) => told.push(why(error)));
  await expect(garage.list()).rejects.toThrow(NothingKept);
  expect(await garage.keepNew(model("1"), nameOf)).toBe("oval-1");
  expect(await garage.keepNew(model("2"), nameOf)).toBe("oval-2");
  expect(told).toHaveLength(2);
  expect(told[0]).toMatch(/^This browser lets the page keep nothing/);

  expect(await garage.rename(garage.models[1]!, "oval-2")).toBe(false);
  expect(await garage.rename(garage.models[1]!, "heron")).toBe(true);
  expect(names(garage)).toEqual(["oval-2", "heron"]);
  await garage.drop("heron");
  expect(names(garage)).toEqual(["oval-2"]);
  await garage.keepNew(model("1"), (number) => (number === 1 ? "heron" : nameOf(number)));
  expect(names(garage)).toEqual(["oval-2", "heron"]);
});
