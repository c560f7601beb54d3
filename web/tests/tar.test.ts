import { execFileSync } from "node:child_process";
import { describe, expect, it } from "vitest";
import { gzip, tar } from "../src/tab/tar";

describe("tar", () => {
  it("is unpacked by others to what was put in", async () => {
    const long = new Uint8Array(1300).fill(65);
    const packed = await gzip(tar({ "car/a.txt": new TextEncoder().encode("fast"), "car/b": long }, 1.7e9));
    const input = new Uint8Array(await packed.arrayBuffer());
    const list = execFileSync("tar", ["-tvz"], { input }).toString();
    expect(list).toMatch(/-rw-r--r--.* 4 2023-11-\d+ .*car\/a.txt\n.* 1300 .*car\/b\n$/);
    expect(execFileSync("tar", ["-xzO", "car/a.txt"], { input }).toString()).toBe("fast");
    expect(execFileSync("tar", ["-xzO", "car/b"], { input }).toString()).toBe("A".repeat(1300));
  });
});
