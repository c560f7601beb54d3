/** Python in colours: what each piece of a source is. */
export type Kind = "plain" | "keyword" | "string" | "number" | "comment" | "name";

const KEYWORDS = new Set(
  "and as assert break class continue def del elif else except finally for from global if import in is lambda nonlocal not or pass raise return try while with yield True False None".split(
    " ",
  ),
);
const PIECE =
  /(?<comment>#[^\n]*)|(?<string>[rbfu]{0,2}(?:"""[\s\S]*?"""|'''[\s\S]*?'''|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'))|(?<number>\b\d[\d_]*(?:\.\d+)?(?:e[+-]?\d+)?\b)|(?<word>[A-Za-z_]\w*)|(?<plain>[^#"'\w]+|.)/gi;

/** The pieces of a source, which together are the source. */
export function pieces(source: string): { kind: Kind; text: string }[] {
  let isName = false;
  return [...source.matchAll(PIECE)].map(({ 0: text, groups }) => {
    const word = groups?.["word"];
    let kind =
      (["comment", "string", "number"] as const).find((one) => groups?.[one] !== undefined) ?? ("plain" as Kind);
    if (word !== undefined) kind = KEYWORDS.has(word) ? "keyword" : isName ? "name" : "plain";
    if (text.trim()) isName = word === "def" || word === "class";
    return { kind, text };
  });
}
