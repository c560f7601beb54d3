import { describe, expect, it } from "vitest";
import { de } from "../src/course/de";
import { en } from "../src/course/en";
import { blocks, inlines, plain, type Block, type Inline } from "../src/course/markdown";
import { playthings } from "../src/course/playthings";
import { pieces } from "../src/course/python";
import { rightOf, rights } from "../src/course/quiz";
import { formula, type Sign } from "../src/course/tex";

const files = import.meta.glob<string>("../../lessons/*.py", { query: "?raw", import: "default", eager: true });

/** Cells of a file, as src/racecraft/course/percent.py reads them, roughly. */
const cellsOf = (file: string) =>
  file.split(/^# %%/m).flatMap((part) => {
    const [mark = "", ...lines] = part.split("\n");
    const isText = mark.includes("[markdown]");
    const source = lines.map((line) => (isText ? line.replace(/^# ?/, "") : line)).join("\n");
    return [{ isText, title: mark.replace("[markdown]", "").trim(), source: source.trim() }];
  });
const lessons = Object.values(files).map(cellsOf);
const germans = import.meta.glob<string>("../../lessons/de/*.md", { query: "?raw", import: "default", eager: true });
const texts = [
  ...lessons.flatMap((cells) => cells.filter((one) => one.isText).map((one) => one.source)),
  ...Object.values(germans).flatMap((file) => file.split(/^<!-- [0-9a-f]{8} -->$/m)),
];

const textsOf = (inner: Inline[]): string[] =>
  inner.flatMap((one) => ("inner" in one ? textsOf(one.inner) : one.kind === "text" ? [one.text] : []));
const inside = (block: Block): Inline[] =>
  block.kind === "list"
    ? block.items.flat()
    : block.kind === "table"
      ? [...block.head, ...block.rows.flat()].flat()
      : "inner" in block
        ? block.inner
        : [];

describe("Markdown", () => {
  it("knows what lessons are written in", () => {
    const found = blocks(
      "# Title\n\nA **bold *and* brave** `x * y`\nline.\n\n- one\n  more\n- two\n\n1. first\n\n> said\n> so\n\n| a | b |\n|---|---|\n| 1 | *2* |\n\n$$x +\ny$$\n\nIt is $b$ of 3 $ here",
    );
    expect(found.map((block) => block.kind)).toEqual([
      "heading",
      "paragraph",
      "list",
      "list",
      "quote",
      "table",
      "math",
      "paragraph",
    ]);
    expect(plain(inside(found[1]!))).toBe("A bold and brave x * y line.");
    expect(found[2]).toMatchObject({ isOrdered: false, items: [[{ text: "one more" }], [{ text: "two" }]] });
    expect(found[3]).toMatchObject({ isOrdered: true });
    expect(found[5]).toMatchObject({ rows: [[[{ text: "1" }], [{ kind: "em" }]]] });
    expect(found[6]).toEqual({ kind: "math", text: "x + y" });
    expect(inside(found[7]!)).toContainEqual({ kind: "math", text: "b" });
  });
  it("makes links of web addresses only", () => {
    expect(inlines("[a](https://b.c)")).toMatchObject([{ kind: "link", href: "https://b.c" }]);
    expect(inlines("[a](javascript:alert)")).toEqual([{ kind: "text", text: "[a](javascript:alert)" }]);
  });
  it("leaves no marks in the text of any lesson", () => {
    expect(lessons).toHaveLength(12);
    for (const source of texts)
      for (const text of blocks(source).flatMap((block) => textsOf(inside(block))))
        expect(text).not.toMatch(/\*\*|`|\$|^#|^\||\]\(/);
  });
});

describe("formulas", () => {
  const text = (sign: Sign): string => (sign.text ?? "") + (sign.of ?? []).map(text).join("");
  it("become MathML", () => {
    const sum = formula("V(s) = \\max_a \\frac{1}{n} x_i^2");
    expect(sum.of!.map((one) => one.tag)).toContain("munder");
    expect(sum.of!.at(-1)).toMatchObject({ tag: "msubsup", of: [{ text: "x" }, { text: "i" }, { text: "2" }] });
    expect(text(formula("\\underbrace{a}_{\\text{two words}}"))).toBe("atwo words");
    expect(text(formula("Q(s', a')"))).toBe("Q(s′,a′)");
  });
  it("of every lesson are known", () => {
    const found = texts
      .flatMap((source) => blocks(source))
      .flatMap((block) => (block.kind === "math" ? [block.text] : []));
    expect(found.length).toBeGreaterThanOrEqual(10);
    for (const tex of found) expect(text(formula(tex))).not.toMatch(/[\\{}~]/);
    expect(() => formula("\\unheard")).toThrow("none of the commands");
    expect(() => formula("\\frac{1")).toThrow("missing");
  });
});

describe("Python", () => {
  it("is coloured and stays what it is", () => {
    expect(pieces("def f(x):  # no\n    return 'if' + 1.5")).toEqual(
      expect.arrayContaining([
        { kind: "keyword", text: "def" },
        { kind: "name", text: "f" },
        { kind: "comment", text: "# no" },
        { kind: "string", text: "'if'" },
        { kind: "number", text: "1.5" },
      ]),
    );
    for (const cell of lessons.flat())
      expect(
        pieces(cell.source)
          .map((piece) => piece.text)
          .join(""),
      ).toBe(cell.source);
  });
});

it("a quiz counts what was answered first", () => {
  const words = { en: "", de: "" };
  const question = (right: number) => ({
    text: words,
    choices: [0, 1, 2].map((index) => ({ text: words, why: words, right: index === right })),
  });
  const quiz = [question(0), question(2)];
  expect(quiz.map(rightOf)).toEqual([0, 2]);
  expect(rights(quiz, [0, 1])).toBe(1);
  expect(rights(quiz, [undefined, 2])).toBe(1);
  expect(rights(quiz, [])).toBe(0);
});

it("what lessons play with is there, each once", () => {
  const asked = lessons.flat().flatMap((cell) => /^plaything (.+)/.exec(cell.title)?.[1] ?? []);
  expect(asked.sort()).toEqual(Object.keys(playthings).sort());
});

it("both languages fill in the same names", () => {
  const names = (text: string) => (text.match(/\{\w+\}/g) ?? []).sort();
  for (const key of Object.keys(en) as (keyof typeof en)[]) expect(names(de[key])).toEqual(names(en[key]));
});
