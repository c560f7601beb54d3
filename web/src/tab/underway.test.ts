import { afterEach, expect, test, vi } from "vitest";

/** A tab's store, or all tabs': of a page that a test makes. */
class Store {
  constructor(private readonly kept = new Map<string, string>()) {}
  getItem = (key: string) => this.kept.get(key) ?? null;
  setItem = (key: string, text: string) => void this.kept.set(key, text);
  removeItem = (key: string) => void this.kept.delete(key);
  copy = () => new Store(new Map(this.kept));
}
type Work = () => unknown;
/** As a browser has them at an address that it trusts; `let go` of a page's own when it is gone. */
class Locks {
  held: string[] = [];
  request = async (name: string, options: { signal?: AbortSignal } | Work, work?: Work) => {
    if (typeof options === "function") return (void this.held.push(name), options());
    if (this.held.includes(name)) throw new DOMException("aborted", "AbortError");
    return work!();
  };
}

async function opened(tab: Store, browser: Store, locks: Locks | undefined) {
  vi.resetModules();
  vi.stubGlobal("sessionStorage", tab);
  vi.stubGlobal("localStorage", browser);
  vi.stubGlobal("navigator", { locks });
  return import("./underway");
}
afterEach(() => vi.unstubAllGlobals());

const training = { id: "1", track: "oval", reward: "def reward_function(params): ...", name: "oval-1", seconds: 7 };

test("what a page was closed over is told once, by its tab's next page or by another tab where it left for good", async () => {
  for (const locks of [new Locks(), undefined]) {
    const [tab, browser] = [new Store(), new Store()];
    const first = await opened(tab, browser, locks);
    first.note(training);
    expect(await (await opened(new Store(), browser, locks)).cutShort()).toBeUndefined(); // it goes on
    first.leave();
    if (locks) locks.held = [];
    const next = await opened(tab, browser, locks);
    expect(await next.cutShort()).toEqual(training);
    expect(await next.cutShort()).toBeUndefined();

    next.note(training);
    next.leave();
    if (locks) locks.held = [];
    const other = await opened(new Store(), browser, locks);
    expect(await other.cutShort()).toEqual(training);
  }
});

test("a training that ended, or goes on in the tab that this one is a copy of, was not cut short", async () => {
  const [tab, browser, locks] = [new Store(), new Store(), new Locks()];
  const page = await opened(tab, browser, locks);
  page.note(training);
  expect(await (await opened(tab.copy(), browser, locks)).cutShort()).toBeUndefined();
  const again = await opened(tab, browser, locks);
  again.note(undefined);
  again.leave();
  expect(await (await opened(tab, browser, locks)).cutShort()).toBeUndefined();
  browser.setItem("racecraft-tab-training", "{not ours");
  expect(await (await opened(new Store(), browser, locks)).cutShort()).toBeUndefined();
});
