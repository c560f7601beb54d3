import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { followModel, RETRY } from "../src/lib/stream";

class Source extends EventTarget {
  readyState = 1;
  onerror: (() => void) | null = null;
  constructor(readonly url: string) {
    super();
  }
  send(kind: string, data: unknown, lastEventId = "") {
    this.dispatchEvent(Object.assign(new Event(kind), { data: JSON.stringify(data), lastEventId }));
  }
  fail(readyState: number) {
    this.readyState = readyState;
    this.onerror?.();
  }
  close() {
    this.readyState = 2;
  }
}

describe("a stream", () => {
  const page = Object.assign(new EventTarget(), { documentElement: {}, hidden: false });
  const sources: Source[] = [];
  const seen: unknown[] = [];
  const open = (url: string) => {
    sources.push(new Source(url));
    return sources[sources.length - 1]! as unknown as EventSource;
  };
  const on = { points: (points: unknown) => void seen.push(points), live: () => undefined, jobs: () => undefined };

  beforeEach(() => {
    vi.useFakeTimers();
    sources.length = seen.length = 0;
    vi.stubGlobal("document", page);
  });
  afterEach(() => vi.useRealTimers());

  it("goes on after the last point when the server answered with an error", () => {
    const stop = followModel("a b", on, open);
    expect(sources[0]!.url).toBe("/api/events/a%20b?offset=0");
    sources[0]!.send("points", [1], "100");
    sources[0]!.fail(2);
    vi.advanceTimersByTime(RETRY);
    expect(sources[1]!.url).toBe("/api/events/a%20b?offset=100");
    sources[1]!.send("points", [2], "200");
    expect(seen).toEqual([[1], [2]]);
    stop();
    expect(sources[1]!.readyState).toBe(2);
  });

  it("asks for pictures only where they are looked at", () => {
    const pictures: unknown[] = [];
    const stop = followModel("a", { ...on, eye: (picture) => void pictures.push(picture) }, open);
    expect(sources[0]!.url).toBe("/api/events/a?offset=0&eye=true");
    sources[0]!.send("eye", { frame: "AA==", frame_shape: [1, 1] });
    expect(pictures).toEqual([{ frame: "AA==", frame_shape: [1, 1] }]);
    stop();
  });

  it("holds no connection while its page is hidden, and goes on when it is seen again", () => {
    const look = (hidden: boolean) => {
      page.hidden = hidden;
      page.dispatchEvent(new Event("visibilitychange"));
    };
    const stop = followModel("a", on, open);
    sources[0]!.send("points", [1], "100");
    look(true);
    expect([sources.length, sources[0]!.readyState]).toEqual([1, 2]);
    look(false);
    expect(sources[1]!.url).toBe("/api/events/a?offset=100");
    stop();
    look(true);
    look(false);
    expect(sources.length).toBe(2);
  });

  it("leaves a broken connection to the browser, and stays closed when it is closed", () => {
    const stop = followModel("a", on, open);
    sources[0]!.fail(0);
    vi.advanceTimersByTime(10 * RETRY);
    expect(sources.length).toBe(1);
    sources[0]!.fail(2);
    stop();
    vi.advanceTimersByTime(10 * RETRY);
    expect(sources.length).toBe(1);
  });
});
