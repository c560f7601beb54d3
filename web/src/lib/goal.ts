/** When a training ends, in the words of `until` that have fields of their own. */
export type GoalKind = "laps" | "lap" | "minutes" | "steps";

export interface Goal {
  kind: GoalKind;
  amount: number; // laps, s, minutes or camera steps
  most: number | undefined; // minutes that it may take, of a skill
}

const WORDS: Record<GoalKind, string> = { laps: "laps", lap: "s lap", minutes: "minutes", steps: "steps" };
const FORMS: [GoalKind, RegExp][] = [
  ["laps", /^laps?$/],
  ["lap", /^s(?:ec(?:ond)?s?)? lap$/],
  ["minutes", /^min(?:ute)?s?$/],
  ["steps", /^steps?$/],
];

function limitOf(text: string): { kind: GoalKind; amount: number } | undefined {
  const match = /^(\d{1,3}(?:[,_]\d{3})+|\d+)(\.\d+)?\s*([a-z]+(?:\s+lap)?)$/.exec(text);
  const unit = match?.[3]!.replace(/\s+/g, " ");
  const kind = FORMS.find(([, form]) => unit !== undefined && form.test(unit))?.[0];
  return kind && { kind, amount: Number(match![1]!.replace(/[,_]/g, "") + (match![2] ?? "")) };
}

/** What a text asks for; nothing where it needs more words than there are fields. */
export function goalOf(until: string): Goal | undefined {
  const [first, second, ...more] = until
    .toLowerCase()
    .split(/\bor\b/)
    .map((part) => limitOf(part.trim()));
  if (!first || more.length) return undefined;
  const isAlone = !/\bor\b/i.test(until);
  if (isAlone) return { ...first, most: undefined };
  const isSkill = first.kind === "laps" || first.kind === "lap";
  return isSkill && second?.kind === "minutes" ? { ...first, most: second.amount } : undefined;
}

export const textOf = ({ kind, amount, most }: Goal): string =>
  `${amount} ${WORDS[kind]}${most === undefined ? "" : ` or ${most} minutes`}`;
