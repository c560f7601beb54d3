/** Roads that are no track of a list: drawn from seeds, or several by one name, as the command line takes them. */
import { t } from "../i18n/index.svelte";

/** The name of roads from a first to a last seed. */
export const generated = (first: number, last = first): string =>
  first === last ? `generated:${first}` : `generated:${first}..${last}`;

/** First and last seed of such a name without options. */
export function seedsOf(road: string): [number, number] | undefined {
  const found = /^generated:(\d{1,15})(?:\.\.(\d{1,15}))?$/.exec(road);
  return found ? [Number(found[1]), Number(found[2] ?? found[1])] : undefined;
}

/** The first single road of a name, to be drawn; none where the list has it, or nothing is to be drawn. */
export const firstGenerated = (road: string): string | undefined =>
  road.startsWith("generated:") ? road.replace(/\.\.\d+/, "") : undefined;

/** What roads are called, by the title of one that is in a list. */
export function roadName(road: string, titleOf: (name: string) => string | undefined): string {
  if (road === "library") return t("road_library");
  const found = /^generated:(\d+)(?:\.\.(\d+))?(,.*)?$/.exec(road);
  if (!found) return titleOf(road) ?? road;
  const [, first, last = first, options = ""] = found;
  const name = first === last ? t("road_seed_of", { seed: first! }) : t("road_seeds", { first: first!, last: last! });
  return name + options.replaceAll(",", ", ");
}
