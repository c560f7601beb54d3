/** The check of a reward function while it is typed: an answer counts for the text that it was asked about, and no longer. */
import { api, Problem, type RewardVerdict, type Tried } from "../api/client";
import { said } from "../i18n/index.svelte";

const PAUSE = 400; // ms without typing, after which the text is checked

export class RewardCheck {
  #text = $state("");
  #of = $state<string | undefined>();
  #found = $state.raw<RewardVerdict | undefined>();
  #timer: ReturnType<typeof setTimeout> | undefined;
  #asked = 0; // questions so far: of the same text about two tracks, the later one counts, whichever is answered first
  readonly #answer: typeof api.checkReward;

  /** `answer`: who is asked, the server or whoever knows as much. */
  constructor(answer: typeof api.checkReward = api.checkReward) {
    this.#answer = answer;
  }

  /** The last answer, for what may be looked at a little longer: the painting. */
  get last(): RewardVerdict | undefined {
    return this.#found;
  }

  /** The answer about the present text; undefined while it is not there. */
  get verdict(): RewardVerdict | undefined {
    return this.#of === this.#text ? this.#found : undefined;
  }

  get isEmpty(): boolean {
    return this.#text.trim() === "";
  }

  /** Why nobody trains with the present text, as the key of a sentence; undefined where nothing speaks against it. */
  get obstacle(): "reward_empty" | "reward_faulty" | undefined {
    if (this.isEmpty) return "reward_empty";
    return this.verdict?.ok === false ? "reward_faulty" : undefined;
  }

  get isChecking(): boolean {
    return !this.isEmpty && this.#of !== this.#text;
  }

  /** A line of 0 says that it is not the text that is wrong: the track is not there any more, say. */
  get problems(): RewardVerdict["problems"] {
    const found = this.verdict?.problems ?? [];
    return found.map((one) => ({ ...one, message: said(one.message), hint: said(one.hint) }));
  }

  /** Check a text in a moment, unless another one comes. */
  ask(text: string, track: string, tried: Tried = {}): void {
    this.#text = text;
    clearTimeout(this.#timer);
    const number = ++this.#asked;
    if (this.isEmpty) return;
    this.#timer = setTimeout(() => void this.#check(number, text, track, tried), PAUSE);
  }

  /** What the server said when the text was to be trained with. */
  refuse(text: string, problem: Problem): void {
    const { message, hint } = problem;
    const mistake = { line: problem.line ?? 0, column: 1, severity: "error" as const, message, hint };
    [this.#of, this.#found] = [text, { ok: false, problems: [mistake], situations: [], painting: null, laps: [] }];
  }

  async #check(number: number, text: string, track: string, tried: Tried) {
    let answer: RewardVerdict | undefined;
    try {
      answer = await this.#answer(text, track, tried);
    } catch (error) {
      if (error instanceof Problem && number === this.#asked) this.refuse(text, error);
      return;
    }
    if (number === this.#asked) [this.#of, this.#found] = [text, answer];
  }
}
