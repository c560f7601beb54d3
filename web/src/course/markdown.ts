/** The Markdown that lessons are written in, as a tree: headings, paragraphs, lists, tables, quotes, formulas. */
export type Inline =
  | { kind: "text"; text: string }
  | { kind: "code"; text: string }
  | { kind: "math"; text: string }
  | { kind: "strong"; inner: Inline[] }
  | { kind: "em"; inner: Inline[] }
  | { kind: "link"; href: string; inner: Inline[] };

export type Block =
  | { kind: "heading"; level: number; inner: Inline[] }
  | { kind: "paragraph"; inner: Inline[] }
  | { kind: "list"; isOrdered: boolean; items: Inline[][] }
  | { kind: "quote"; inner: Inline[] }
  | { kind: "table"; head: Inline[][]; rows: Inline[][][] }
  | { kind: "math"; text: string }
  | { kind: "code"; text: string };

const ITEM = /^(?:-|\d+\.) +/;
const MARKS = /(`+)(.+?)\1|\*\*(.+?)\*\*|\*(.+?)\*|\[([^\]]+)\]\(([^)\s]+)\)|\$([^$\s](?:[^$]*[^$\s])?)\$/;

/** Text with emphasis, code, formulas and links; an address that is none of the web is left as it stands. */
export function inlines(text: string): Inline[] {
  const found = MARKS.exec(text);
  if (!found) return text ? [{ kind: "text", text }] : [];
  const [all, , code, strong, em, label, href, math] = found;
  let part: Inline = { kind: "text", text: all };
  if (code !== undefined) part = { kind: "code", text: code };
  else if (strong !== undefined) part = { kind: "strong", inner: inlines(strong) };
  else if (em !== undefined) part = { kind: "em", inner: inlines(em) };
  else if (math !== undefined) part = { kind: "math", text: math };
  else if (/^https?:\/\//.test(href!)) part = { kind: "link", href: href!, inner: inlines(label!) };
  return [...inlines(text.slice(0, found.index)), part, ...inlines(text.slice(found.index + all.length))];
}

const cells = (line: string): Inline[][] =>
  line
    .trim()
    .replace(/^\||\|$/g, "")
    .split("|")
    .map((cell) => inlines(cell.trim()));

/** The blocks of a text. */
export function blocks(text: string): Block[] {
  const found: Block[] = [];
  const lines = text.split("\n");
  const takeWhile = (is: (line: string) => boolean) => {
    const taken: string[] = [];
    while (lines.length && is(lines[0]!)) taken.push(lines.shift()!);
    return taken;
  };
  while (lines.length) {
    const line = lines[0]!;
    const heading = /^(#{1,6}) +(.*)$/.exec(line);
    if (!line.trim()) lines.shift();
    else if (heading) {
      lines.shift();
      found.push({ kind: "heading", level: heading[1]!.length, inner: inlines(heading[2]!) });
    } else if (line.startsWith("```")) {
      lines.shift();
      found.push({ kind: "code", text: takeWhile((one) => !one.startsWith("```")).join("\n") });
      lines.shift();
    } else if (line.startsWith("$$")) {
      const taken = [lines.shift()!];
      while (lines.length && !taken.join(" ").slice(2).trimEnd().endsWith("$$")) taken.push(lines.shift()!);
      found.push({ kind: "math", text: taken.join(" ").trim().slice(2, -2) });
    } else if (line.startsWith(">")) {
      const taken = takeWhile((one) => one.startsWith(">")).map((one) => one.replace(/^> ?/, ""));
      found.push({ kind: "quote", inner: inlines(taken.join(" ")) });
    } else if (line.startsWith("|")) {
      const [head, , ...rows] = takeWhile((one) => one.startsWith("|"));
      found.push({ kind: "table", head: cells(head!), rows: rows.map(cells) });
    } else if (ITEM.test(line)) {
      const items: string[] = [];
      for (const one of takeWhile((one) => ITEM.test(one) || /^ +\S/.test(one)))
        if (ITEM.test(one)) items.push(one.replace(ITEM, ""));
        else items.push(`${items.pop()} ${one.trim()}`);
      found.push({ kind: "list", isOrdered: /^\d/.test(line), items: items.map(inlines) });
    } else {
      const taken = [lines.shift()!];
      taken.push(...takeWhile((one) => one.trim() !== "" && !/^(#{1,6} |\$\$|>|\||```)/.test(one) && !ITEM.test(one)));
      found.push({ kind: "paragraph", inner: inlines(taken.join(" ")) });
    }
  }
  return found;
}

/** What a text says, without its marks. */
export const plain = (inner: Inline[]): string =>
  inner.map((one) => ("text" in one ? one.text : plain(one.inner))).join("");
