/** Deutsch. */
import type { Key } from "../en";
import { analysis } from "./analysis";
import { contests } from "./contests";
import { create } from "./create";
import { draw } from "./draw";
import { drive } from "./drive";
import { evaluation } from "./evaluation";
import { garage } from "./garage";
import { params } from "./params";
import { presets } from "./presets";
import { races } from "./races";
import { replay } from "./replay";
import { settings } from "./settings";
import { shell } from "./shell";
import { sweeps } from "./sweeps";
import { tracks } from "./tracks";
import { tune } from "./tune";
import { watch } from "./watch";
import { why } from "./why";

export const de: Record<Key, string> = {
  ...shell,
  ...replay,
  ...why,
  ...analysis,
  ...contests,
  ...create,
  ...params,
  ...presets,
  ...watch,
  ...tune,
  ...sweeps,
  ...garage,
  ...evaluation,
  ...tracks,
  ...draw,
  ...drive,
  ...races,
  ...settings,
};
