/** By whose rules something was driven, in whose car: what a genuine replay is worth, as racecraft.race.provenance. */
import { type Bots, type Header, type Obstacles, type Rules } from "./header";

type Values = Record<string, unknown>;

/** What the library has by name. */
export interface Known {
  rules: Record<string, Rules>;
  vehicle: Record<string, Record<string, number>>; // the standard car first
  randomize: Record<string, Record<string, [number, number]>>;
}

/** A library's one by name, and where it is not that: what differs, as [name, value, value of the library's]. */
export interface Likeness {
  name: string;
  differing: [string, string, string][];
}

export interface Provenance {
  rules: Likeness;
  vehicle: Likeness;
  randomize: Likeness; // named "none" where nothing differs from episode to episode
  obstacles: Pick<Obstacles, "count" | "kind"> | null;
  bots: Pick<Bots, "count" | "speed"> | null;
  others: number; // cars on the same road
}

// Rules that say what is driven; the others, what mistakes cost, are what a rule set is known by.
const CHOICES = "laps time_limit direction starts start_offset lateral_jitter heading_jitter".split(" ");

export function provenanceOf(header: Omit<Header, "cars">, known: Known): Provenance {
  const { obstacles, bots } = header.objects;
  return {
    rules: nearest(header.rules, known.rules, CHOICES),
    vehicle: nearest(header.vehicle, known.vehicle),
    randomize: nearest(header.randomize, known.randomize),
    obstacles,
    bots,
    others: header.cars_per_race - 1,
  };
}

/** The most similar by name, the first of equals. */
function nearest<T extends object>(given: T, known: Record<string, T>, left: string[] = []): Likeness {
  const [values, all] = [given as Values, Object.entries(known) as [string, Values][]];
  const likenesses = all.map(([name, one]): Likeness => {
    const keys = [...new Set([...Object.keys(one), ...Object.keys(values)])].filter((key) => !left.includes(key));
    const differing = keys.filter((key) => text(values[key]) !== text(one[key]));
    return { name, differing: differing.map((key) => [key, text(values[key]), text(one[key])]) };
  });
  return likenesses.reduce((best, one) => (one.differing.length < best.differing.length ? one : best));
}

const text = (value: unknown): string =>
  Array.isArray(value)
    ? value.map(String).join(" – ")
    : typeof value === "number"
      ? String(value)
      : `${value as string}`;
