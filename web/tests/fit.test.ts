import { expect, test } from "vitest";
import { standBack } from "../src/scene/fit";

const length = Math.hypot(0.72, 0.62);
const view = {
  back: [0, -0.72 / length, 0.62 / length],
  right: [1, 0, 0],
  up: [0, 0.62 / length, 0.72 / length],
} as const;

test.each([0.4, 0.8, 1.45, 3])("a track lies whole in a picture of any shape: %d", (aspect) => {
  for (const [wide, high] of [
    [8, 2],
    [3, 3],
    [2, 9],
  ] as const) {
    const corners = [-1, 1].flatMap((x) => [-1, 1].map((y) => [x * wide, y * high, 0] as const));
    const tangent = Math.tan((21 * Math.PI) / 180);
    const distance = standBack(corners, view, tangent, aspect);
    let fullest = 0;
    for (const [x, y] of corners) {
      const depth = distance - y * view.back[1];
      const [across, above] = [x / (depth * tangent * aspect), (y * view.up[1]) / (depth * tangent)];
      fullest = Math.max(fullest, Math.abs(across), Math.abs(above));
    }
    expect(fullest).toBeLessThan(1);
    expect(fullest).toBeGreaterThan(0.85); // and not from further away than is needed
  }
});
