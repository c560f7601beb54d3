/** A drawing that draws nearly the same road as a track of the library: racecraft.track.sketch.sketch_of. */
import { tidy, type Sketch } from "../../lib/sketch";
import type { TrackFile } from "../plan";
import { Road, roundHalfEven } from "../road";

const MOST_POINTS = 80;

export function sketchOf(track: TrackFile): Sketch {
  const road = new Road(track, false);
  const { length, isClosed } = road;
  const count = Math.max(8, Math.min(MOST_POINTS, roundHalfEven(length)));
  const points = Array.from({ length: count }, (_, at) => {
    const s = (length * at) / (isClosed ? count : count - 1);
    const [x, y] = road.pointAt(s);
    return tidy({ x, y, width: road.widthAt(s) });
  });
  return { points, is_closed: isClosed };
}
