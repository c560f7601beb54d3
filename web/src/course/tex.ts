/** Formulas of the lessons: the little of TeX that they use, as a tree of MathML. */
export interface Sign {
  tag: string;
  text?: string;
  of?: Sign[];
  attributes?: Record<string, string>;
}

const LETTERS: Record<string, string> = {
  alpha: "α",
  gamma: "γ",
  delta: "δ",
  varepsilon: "ε",
  epsilon: "ε",
  lambda: "λ",
  pi: "π",
  theta: "θ",
  sigma: "σ",
};
const OPERATORS: Record<string, string> = {
  leftarrow: "←",
  mid: "|",
  cdot: "·",
  times: "×",
  nabla: "∇",
  propto: "∝",
  dots: "…",
  sum: "∑",
  le: "≤",
  ge: "≥",
};
const NAMES = ["max", "min", "log", "exp", "clip"];
const SPACES: Record<string, string> = { ",": "0.17em", ";": "0.28em", quad: "1em", qquad: "2em" };
const UNDER = ["∑", "max", "min"];
const TOKEN = /\\([a-zA-Z]+|[^a-zA-Z])|\s+|([0-9.]+)|(.)/gs;

type Token = { command: string } | { number: string } | { sign: string };

const tokens = (tex: string): Token[] =>
  [...tex.matchAll(TOKEN)].flatMap(([, command, number, sign]): Token[] =>
    command !== undefined ? [{ command }] : number !== undefined ? [{ number }] : sign !== undefined ? [{ sign }] : [],
  );

/** The source between braces as it stands, for words. */
const words = (tex: string) =>
  tex.replace(/\\text\{([^}]*)\}/g, (_, text: string) => `\\text{${text.replaceAll(" ", "~")}}`);

/**
 * A formula as MathML.
 *
 * @throws Error - of a command that is not among these.
 */
export function formula(tex: string): Sign {
  const rest = tokens(words(tex));
  const is = (sign: string) => rest[0] !== undefined && "sign" in rest[0] && rest[0].sign === sign;

  function group(): Sign {
    if (!is("{")) return atom();
    rest.shift();
    const inner = row("}");
    rest.shift();
    return inner;
  }
  function letters(): string {
    let text = "";
    rest.shift();
    while (rest.length && !is("}")) {
      const one = rest.shift()!;
      text += "sign" in one ? one.sign : "number" in one ? one.number : `\\${one.command}`;
    }
    rest.shift();
    return text.replaceAll("~", " ");
  }
  function atom(): Sign {
    const one = rest.shift();
    if (!one) throw new Error(`${tex}: something is missing at the end`);
    if ("number" in one) return { tag: "mn", text: one.number };
    if ("sign" in one)
      return /[a-zA-Z]/.test(one.sign)
        ? { tag: "mi", text: one.sign }
        : { tag: "mo", text: one.sign === "-" ? "−" : one.sign, attributes: { stretchy: "false" } };
    const { command } = one;
    if (command in LETTERS) return { tag: "mi", text: LETTERS[command]! };
    if (command in OPERATORS) return { tag: "mo", text: OPERATORS[command]! };
    if (command in SPACES) return { tag: "mspace", attributes: { width: SPACES[command]! } };
    if (NAMES.includes(command)) return { tag: "mo", text: command, attributes: { lspace: "0.2em", rspace: "0.2em" } };
    if (command === "text") return { tag: "mtext", text: letters() };
    if (command === "frac") return { tag: "mfrac", of: [group(), group()] };
    if (command === "big") return { ...atom(), attributes: { minsize: "1.3em", maxsize: "1.3em" } };
    if (command === "underbrace") return { tag: "mrow", of: [group()], attributes: { class: "braced" } };
    throw new Error(`${tex}: \\${command} is none of the commands that lessons use`);
  }
  function scripted(): Sign {
    let base = atom();
    let below: Sign | undefined;
    let above: Sign | undefined;
    let prime: Sign | undefined;
    for (;;)
      if (is("_")) {
        rest.shift();
        below = group();
      } else if (is("^")) {
        rest.shift();
        above = group();
      } else if (is("'")) {
        rest.shift();
        prime = { tag: "mo", text: "′", attributes: { lspace: "0", rspace: "0" } };
      } else break;
    if (prime) base = { tag: "mrow", of: [base, prime] };
    const isUnder = base.attributes?.["class"] === "braced" || UNDER.includes(base.text ?? "");
    if (below && above) return { tag: isUnder ? "munderover" : "msubsup", of: [base, below, above] };
    if (below) return { tag: isUnder ? "munder" : "msub", of: [base, below] };
    return above ? { tag: isUnder ? "mover" : "msup", of: [base, above] } : base;
  }
  function row(end = ""): Sign {
    const of: Sign[] = [];
    while (rest.length && !(end && is(end))) of.push(scripted());
    if (end && !rest.length) throw new Error(`${tex}: ${end} is missing`);
    return { tag: "mrow", of };
  }
  return row();
}
