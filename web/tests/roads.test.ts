import { afterEach, describe, expect, it } from "vitest";
import { choose } from "../src/i18n/language.svelte";
import { roadName } from "../src/lib/roads";

describe("what a road is called", () => {
  afterEach(() => choose("en"));
  const called = (road: string) => roadName(road, (name) => (name === "oval" ? "Oval" : undefined));

  it("is its title, or its name", () => {
    expect(["oval", "mine", "oval + generated:3"].map(called)).toEqual(["Oval", "mine", "oval + generated:3"]);
  });

  it("is said in words where a seed draws it, as its name breaks behind the colon", () => {
    expect(called("generated:1")).toBe("generator, seed 1");
    expect(called("generated:1..1")).toBe("generator, seed 1");
    expect(called("generated:0..47,radius=0.45,width=1")).toBe("generator, seeds 0 to 47, radius=0.45, width=1");
    choose("de");
    expect(called("generated:1")).toBe("Generator, Startzahl 1");
  });
});
