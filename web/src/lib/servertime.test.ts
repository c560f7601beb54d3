import { expect, test, vi } from "vitest";
import { sentAt, serverNow } from "./servertime";

test("the server's time is known to a computer whose clock is wrong by a day, and its own is taken where both agree", () => {
  vi.useFakeTimers({ now: Date.parse("2026-12-01T09:00:00Z") });
  sentAt("Mon, 30 Nov 2026 09:00:00 GMT");
  vi.advanceTimersByTime(1500);
  expect(serverNow()).toBe(Date.parse("2026-11-30T09:00:01.500Z"));
  for (const nothing of [null, "soon"]) sentAt(nothing);
  expect(serverNow()).toBe(Date.parse("2026-11-30T09:00:01.500Z"));
  sentAt("Tue, 01 Dec 2026 09:00:00 GMT");
  expect(serverNow()).toBe(Date.now());
  vi.useRealTimers();
});
