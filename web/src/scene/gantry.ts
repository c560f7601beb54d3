/** The start: a chequered line across the road, and a gantry over it. */
import * as three from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { TrackGeometry } from "../api/client";
import { paintFaces, paintGround } from "./paint";

const SQUARE = 0.075; // m, about; of the line
const POST = { thick: 0.045, beyond: 0.1 }; // m, its width and how far from the road it stands
const BEAM = { low: 0.6, squares: 2, square: 0.1, thick: 0.05 }; // m, clear of every camera that rides with a car
const [DARK, LIGHT, STEEL] = [0x1b1f25, 0xf2f2ee, 0x59626e];

const box = (size: [number, number, number], at: [number, number, number], color: number): three.BufferGeometry =>
  paintFaces(new three.BoxGeometry(...size).translate(...at), color);

/** Both, in one piece; `height` is that of what is painted on the road. */
export function gantryGeometry({ center, inner, outer }: TrackGeometry, height: number): three.BufferGeometry {
  const [start, left, right] = [center[0]!, inner[0]!, outer[0]!];
  const [dx, dy] = [right[0]! - left[0]!, right[1]! - left[1]!];
  const width = Math.hypot(dx, dy);
  const pieces: three.BufferGeometry[] = [];

  // built along x across the road and y along it, and then turned there
  const count = Math.max(2, Math.round(width / SQUARE));
  const across = width / count;
  for (let column = 0; column < count; column++)
    for (let row = 0; row < 2; row++) {
      const square = new three.PlaneGeometry(across, SQUARE);
      square.translate((column + 0.5) * across - width / 2, (row - 0.5) * SQUARE, height);
      pieces.push(paintGround(square, (column + row) % 2 ? DARK : LIGHT));
    }
  const foot = width / 2 + POST.beyond;
  const top = BEAM.low + BEAM.squares * BEAM.square;
  for (const side of [-foot, foot]) pieces.push(box([POST.thick, POST.thick, top], [side, 0, top / 2], STEEL));
  const panels = Math.max(4, Math.round((2 * foot) / BEAM.square));
  const panel = (2 * foot) / panels;
  for (let column = 0; column < panels; column++)
    for (let row = 0; row < BEAM.squares; row++)
      pieces.push(
        box(
          [panel, BEAM.thick, BEAM.square],
          [(column + 0.5) * panel - foot, 0, BEAM.low + (row + 0.5) * BEAM.square],
          (column + row) % 2 ? DARK : LIGHT,
        ),
      );
  const middle = [(left[0]! + right[0]!) / 2, (left[1]! + right[1]!) / 2];
  return mergeGeometries(pieces)
    .rotateZ(Math.atan2(dy, dx))
    .translate(width > 0 ? middle[0]! : start[0]!, width > 0 ? middle[1]! : start[1]!, 0);
}
