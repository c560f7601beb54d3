import { describe, expect, it } from "vitest";
import { apart, ghostLabels } from "../src/lib/contests";
import { ofStamp } from "../src/lib/dates";

describe("ghosts of a film", () => {
  const ghost = (name: string, is_lap = false) => ({ name, is_lap, trace: [] });

  it("are told apart by the moment of their evaluation, and within a minute by number", () => {
    const stamps = ["20261128103821", "20261128103825", "20261128114000"];
    const moments = stamps.map((stamp) => `ada (${ofStamp(stamp)})`);
    expect(moments[0]).toBe(moments[1]);
    expect(ghostLabels([...stamps.map((stamp) => ghost(`ada ${stamp}`)), ghost("ada"), ghost("ada@last")])).toEqual([
      moments[0],
      `${moments[1]} (2)`,
      moments[2],
      "ada",
      "ada@last",
    ]);
  });

  it("keep names that only one has", () => {
    expect(ghostLabels([ghost("bob-20261128103821"), ghost("x", true)])[0]).toBe("bob-20261128103821");
    expect(apart(["a", "b", "a", "a"])).toEqual(["a", "b", "a (2)", "a (3)"]);
  });
});
