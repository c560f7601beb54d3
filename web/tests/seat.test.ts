import { expect, test, vi } from "vitest";
import type { Report } from "../src/tab/worker";

/** A worker whose car has just finished a lap. */
class Lapped {
  onmessage: (event: { data: Report }) => void = () => undefined;
  terminate = () => undefined;
  postMessage({ kind }: { kind: string }) {
    if (kind === "sit") this.answer({ kind: "seated", drive: { id: "1" } });
    if (kind === "steer") this.answer({ kind: "steered", state: { finished: { seconds: 7.5 } }, trace: [[0, 0, 0]] });
  }
  private answer(data: unknown) {
    queueMicrotask(() => this.onmessage({ data: data as Report }));
  }
}
vi.mock("../src/tab/open", () => ({ openWorker: () => new Lapped() }));
const { TabSeat } = await import("../src/tab/seat");

test("a best lap for which the browser has no room is told, and raced against all the same", async () => {
  const told: unknown[] = []; // there is no storage at all here
  const track = { geometry: { name: "oval" }, digest: "d" } as never;
  const seat = new TabSeat("", { tracks: ["oval"], medals: {} } as never, track, [], (error) => told.push(error));
  await seat.begin({ vehicle: "v5", direction: "forward" });
  const { finished } = await seat.step("1", { steering: 0, speed: 1, steps: 1 });
  expect(finished).toEqual({ seconds: 7.5, is_best: true });
  expect(told).toHaveLength(1);
  expect((await seat.ghost("you")).seconds).toBe(7.5);
  const again = await seat.step("1", { steering: 0, speed: 1, steps: 1 });
  expect(again.finished).toEqual({ seconds: 7.5 }); // as fast is no better
});
