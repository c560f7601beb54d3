import { afterEach, describe, expect, it, vi } from "vitest";
import { behind, Driver } from "../src/lib/driver";

describe("Driver", () => {
  it("turns and speeds up gradually, within the car's limits", () => {
    const driver = new Driver();
    driver.held.add("gas").add("left");
    const first = driver.advance(1 / 15);
    expect(first.steering).toBeGreaterThan(0);
    expect(first.speed).toBeLessThan(0.5);
    for (let i = 0; i < 60; i++) driver.advance(1 / 15);
    expect(driver.speed).toBe(driver.top);
    expect(driver.steering).toBeLessThan(Math.PI / 6);
    driver.held.clear();
    for (let i = 0; i < 60; i++) driver.advance(1 / 15);
    expect(driver.advance(1 / 15)).toEqual({ steering: 0, speed: 0 });
  });
  it("brakes harder than it coasts, and never below standing", () => {
    const driver = new Driver();
    driver.speed = 3;
    driver.held.add("brake").add("gas");
    for (let i = 0; i < 6; i++) driver.advance(1 / 15);
    expect(driver.speed).toBe(0);
  });
});

describe("behind", () => {
  const trace = Array.from({ length: 150 }, (_, i) => [100 * (i + 1), 0, 0]);
  it("is nothing for one who drives as the ghost did", () => {
    expect(behind(trace, [6000, 50], 60 / 15, 55).seconds).toBeCloseTo(0);
  });
  it("is what one lost or gained", () => {
    expect(behind(trace, [6000, 0], 75 / 15, 55).seconds).toBeCloseTo(1);
    expect(behind(trace, [6000, 0], 45 / 15, 55).seconds).toBeCloseTo(-1);
  });
});

describe("a gamepad", () => {
  const held = (axis: number, gas: number, brake: number) => ({
    connected: true,
    mapping: "standard",
    axes: [axis],
    buttons: Array.from({ length: 17 }, (_, index) => ({ value: index === 7 ? gas : index === 6 ? brake : 0 })),
  });
  const plug = (pad: unknown) => vi.stubGlobal("navigator", { getGamepads: () => [null, pad] });
  afterEach(() => vi.unstubAllGlobals());

  it("steers and speeds as far as it is pushed", () => {
    plug(held(-1, 0.5, 0));
    const driver = new Driver();
    expect(driver.isDriving).toBe(true);
    for (let step = 0; step < 30; step++) driver.advance(1 / 15);
    expect(driver.speed).toBeCloseTo(0.5 * driver.top);
    expect(driver.advance(1 / 15).steering).toBeGreaterThan(0.4); // to the left
    plug(held(0, 0, 1));
    expect(driver.advance(1).speed).toBe(0);
  });
  it("that the browser does not know the layout of is left alone", () => {
    plug({ ...held(1, 1, 0), mapping: "" });
    expect(new Driver().isDriving).toBe(false);
  });
});
