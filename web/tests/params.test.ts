import { describe, expect, it } from "vitest";
import { paramAt } from "../src/lib/params";

describe("a key of params", () => {
  const line = "    return params['speed'] * params.get(\"progress\")";

  it("is found where the pointer is, in either quotes", () => {
    expect(paramAt(line, 19)).toEqual({ name: "speed", from: 19, to: 24 });
    expect(paramAt(line, 24)?.name).toBe("speed");
    expect(paramAt(line, 43)?.name).toBe("progress");
  });
  it("is not any other word", () => {
    expect(paramAt(line, 6)).toBeUndefined();
    expect(paramAt("x = 'constructor'", 8)).toBeUndefined();
    expect(paramAt("speed = 1", 2)).toBeUndefined();
  });
});
