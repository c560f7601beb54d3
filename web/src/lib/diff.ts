/** What differs between two texts, and between the settings of some runs. */
export interface DiffLine {
  kind: "same" | "removed" | "added";
  text: string;
  before: number | null; // line numbers from 1
  after: number | null;
}

const MAX_CELLS = 16_000_000; // of the table; longer texts are compared as a whole

/** The shortest way from one text to the other, line by line. */
export function diffLines(before: string, after: string): DiffLine[] {
  const [a, b] = [before.split("\n"), after.split("\n")];
  let [start, aEnd, bEnd] = [0, a.length, b.length];
  while (start < aEnd && start < bEnd && a[start] === b[start]) start++;
  while (aEnd > start && bEnd > start && a[aEnd - 1] === b[bEnd - 1]) [aEnd, bEnd] = [aEnd - 1, bEnd - 1];
  const [n, m] = [aEnd - start, bEnd - start];
  const found: DiffLine[] = [];
  const same = (i: number, j: number) => found.push({ kind: "same", text: a[i]!, before: i + 1, after: j + 1 });
  const removed = (i: number) => found.push({ kind: "removed", text: a[i]!, before: i + 1, after: null });
  const added = (j: number) => found.push({ kind: "added", text: b[j]!, before: null, after: j + 1 });
  for (let i = 0; i < start; i++) same(i, i);
  if ((n + 1) * (m + 1) > MAX_CELLS) {
    for (let i = start; i < aEnd; i++) removed(i);
    for (let j = start; j < bEnd; j++) added(j);
  } else {
    // length of the longest common rest from every pair of lines on
    const rest = new Uint32Array((n + 1) * (m + 1));
    for (let i = n - 1; i >= 0; i--)
      for (let j = m - 1; j >= 0; j--)
        rest[i * (m + 1) + j] =
          a[start + i] === b[start + j]
            ? rest[(i + 1) * (m + 1) + j + 1]! + 1
            : Math.max(rest[(i + 1) * (m + 1) + j]!, rest[i * (m + 1) + j + 1]!);
    let [i, j] = [0, 0];
    while (i < n || j < m) {
      if (i < n && j < m && a[start + i] === b[start + j]) same(start + i++, start + j++);
      else if (i < n && (j >= m || rest[(i + 1) * (m + 1) + j]! >= rest[i * (m + 1) + j + 1]!)) removed(start + i++);
      else added(start + j++);
    }
  }
  for (let i = aEnd; i < a.length; i++) same(i, i - aEnd + bEnd);
  return found;
}

/** Unchanged stretches cut to some lines around what differs; null marks a cut. */
export function around(lines: DiffLine[], reach = 3): (DiffLine | null)[] {
  const near = lines.map((_, index) =>
    lines.slice(Math.max(0, index - reach), index + reach + 1).some((line) => line.kind !== "same"),
  );
  const found: (DiffLine | null)[] = [];
  lines.forEach((line, index) => {
    if (near[index]) found.push(line);
    else if (found.length && found[found.length - 1] !== null) found.push(null);
  });
  return found;
}

/** A nested document as dotted names and texts. */
export function flatten(value: unknown, name = ""): Map<string, string> {
  const found = new Map<string, string>();
  if (value !== null && typeof value === "object" && !Array.isArray(value)) {
    for (const [key, item] of Object.entries(value))
      for (const [inner, text] of flatten(item, name ? `${name}.${key}` : key)) found.set(inner, text);
  } else found.set(name, typeof value === "string" ? value : JSON.stringify(value));
  return found;
}

export interface Difference {
  name: string;
  /** One for each of what is compared. */
  values: (string | undefined)[];
}

/** Settings by name with each run's value, only those that are not the same for all. */
export function differences(documents: unknown[]): Difference[] {
  const flat = documents.map((document) => flatten(document));
  const names = [...new Set(flat.flatMap((one) => [...one.keys()]))].sort();
  return names
    .map((name) => ({ name, values: flat.map((one) => one.get(name)) }))
    .filter(({ values }) => new Set(values).size > 1);
}
