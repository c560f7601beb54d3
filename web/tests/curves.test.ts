import { describe, expect, it } from "vitest";
import { bestLapOf, completionOf, Curves, hints, logOf, smooth, type Point } from "../src/lib/curves";

const iteration = (step: number, more: object = {}): Point => ({
  kind: "iteration",
  step,
  seconds: step / 1000,
  ...more,
});

describe("curves", () => {
  it("replace what a run that was set back writes again", () => {
    const curves = new Curves();
    curves.add([iteration(1), iteration(2), iteration(3)]);
    curves.add([iteration(2, { again: true }), iteration(4)]);
    expect(curves.iterations.map((point) => point.step)).toEqual([1, 2, 4]);
    expect(curves.iterations[1]!["again"]).toBe(true);
  });

  it("stay small in a tab that is open for hours, and keep their ends", () => {
    const curves = new Curves();
    for (let step = 1; step <= 20000; step++) curves.add([iteration(step)]);
    expect(curves.iterations.length).toBeLessThanOrEqual(4000);
    expect(curves.iterations[0]!.step).toBe(1);
    expect(curves.last!.step).toBeGreaterThan(19990);
  });

  it("keep both ends however many come at once", () => {
    for (const many of [4000, 4001, 4002, 9001, 20000]) {
      const curves = new Curves();
      curves.add(Array.from({ length: many }, (_, step) => iteration(step)));
      expect(curves.iterations.length).toBeLessThanOrEqual(4000);
      expect(curves.iterations.length).toBeGreaterThan(1999);
      expect([curves.iterations[0]!.step, curves.last!.step]).toEqual([0, many - 1]);
    }
  });

  it("keep few evaluations and notes, the best among them", () => {
    const curves = new Curves();
    for (let step = 1; step <= 9000; step++) {
      curves.add([
        { kind: "evaluation", step, seconds: step, is_best: step === 2 },
        { kind: "note", step, seconds: step, text: "" },
      ]);
    }
    expect(curves.evaluations.length).toBeLessThanOrEqual(4001);
    expect(curves.best!.step).toBe(2);
    expect(curves.notes.length).toBe(500);
    expect(curves.notes[499]!.step).toBe(9000);
  });

  it("know the best evaluation", () => {
    const curves = new Curves();
    const judged = (step: number, is_best: boolean): Point => ({
      kind: "evaluation",
      step,
      seconds: step,
      completions: [1, 0.5],
      lap_times: [9.5],
      is_best,
    });
    curves.add([judged(1, true), judged(2, true), judged(3, false)]);
    expect(curves.best!.step).toBe(2);
    expect(completionOf(curves.best!)).toBeCloseTo(0.75);
    expect(bestLapOf(curves.best!)).toBe(9.5);
  });
});

describe("smoothing", () => {
  it("leaves a constant alone and gaps where nothing is known", () => {
    expect(smooth([2, 2, 2], 5)).toEqual([2, 2, 2]);
    expect(smooth([null, null], 3)).toEqual([null, null]);
    expect(smooth([0, null, 2], 1)).toEqual([0, 1, 2]);
    expect(smooth([1, 9], 0)).toEqual([1, 9]);
  });
});

describe("hints", () => {
  const run = (make: (share: number) => object) => {
    const curves = new Curves();
    for (let index = 0; index < 100; index++)
      curves.add([iteration(1000 * (index + 1), { entropy: 2, value_loss: 1, ...make(index / 99) })]);
    return hints(curves, 10).map((hint) => hint.key);
  };

  it("say nothing about a training that goes well", () => {
    expect(run((share) => ({ reward: 10 * share, completion: share }))).toEqual([]);
  });
  it("see a policy that has made up its mind too early", () => {
    expect(run(() => ({ reward: 1, completion: 0.2, entropy: 0.01 }))).toEqual(["entropy"]);
  });
  it("see a value loss that runs away", () => {
    expect(run((share) => ({ reward: 10 * share, completion: share, value_loss: share > 0.95 ? 1000 : 1 }))).toEqual([
      "value",
    ]);
  });
  it("see a reward that is earned without driving", () => {
    expect(run((share) => ({ reward: 1 + 50 * share, completion: 0.1 }))).toEqual(["exploit"]);
  });
  it("see steps that are too large", () => {
    expect(run((share) => ({ reward: 10 * share, completion: share, approx_kl: 0.4 }))).toEqual(["kl"]);
  });
  it("see a policy that forgets what it could", () => {
    const curves = new Curves();
    for (let index = 0; index < 30; index++)
      curves.add([iteration(1000 * (index + 1), { entropy: 2, value_loss: 1, reward: 1, completion: 0.9 })]);
    const judged = (step: number, share: number, is_best: boolean): Point => ({
      kind: "evaluation",
      step,
      seconds: step / 1000,
      completions: [share],
      lap_times: [],
      is_best,
    });
    curves.add([judged(5000, 1, true), judged(10000, 0.5, false), judged(20000, 0.4, false)]);
    expect(hints(curves, 10)).toEqual([]);
    curves.add([judged(30000, 0.6, false)]);
    expect(hints(curves, 10)).toEqual([
      { key: "forgot", values: { best: "100\u00a0%", step: "5,000", now: "60\u00a0%" } },
    ]);
    expect(logOf(curves).map((entry) => entry.kind)).toEqual(["evaluation", "evaluation", "evaluation", "best"]);
  });
  it("see it in a short training, too, but not from one lucky iteration", () => {
    const short = (reward: (share: number) => number) => {
      const curves = new Curves();
      curves.add(
        Array.from({ length: 30 }, (_, index) => ({
          kind: "iteration",
          step: 1000 * (index + 1),
          seconds: index,
          reward: reward(index / 29),
          completion: 0.1,
          entropy: 1,
          value_loss: 1,
        })),
      );
      return hints(curves, 10).map((hint) => hint.key);
    };
    expect(short((share) => 1 + 50 * share)).toEqual(["exploit"]);
    expect(short((share) => (share === 1 ? 9 : 5))).toEqual([]);
  });
  it("see a car that is stuck", () => {
    expect(run(() => ({ reward: 1, completion: 0.05 }))).toEqual(["stuck"]);
  });
});
