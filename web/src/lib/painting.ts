/** What a reward pays on a grid along a track, as cells to be filled. */
import { scale } from "./colors";

export interface Cell {
  d: string;
  fill: string;
}

const FARTHEST = 2; // m between neighbours; more is where an open track ends

/** A cell between four neighbours on the grid (P, O), closed around the lap. */
export function cellsOf(points: number[][][], rewards: (number | null)[][], [low, high]: [number, number]): Cell[] {
  const found: Cell[] = [];
  points.forEach((row, place) => {
    const next = points[(place + 1) % points.length]!;
    for (let across = 0; across + 1 < row.length; across++) {
      const corners = [row[across]!, row[across + 1]!, next[across + 1]!, next[across]!];
      if (Math.hypot(corners[0]![0]! - corners[3]![0]!, corners[0]![1]! - corners[3]![1]!) > FARTHEST) continue;
      const around = [rewards[place]![across]!, rewards[place]![across + 1]!].filter((value) => value !== null);
      if (!around.length) continue;
      const mean = around.reduce((sum, value) => sum + value, 0) / around.length;
      const d = `M${corners.map(([x, y]) => `${x} ${-y!}`).join("L")}Z`;
      found.push({ d, fill: scale((mean - low) / (high - low)) });
    }
  });
  return found;
}
