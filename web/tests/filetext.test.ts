import { describe, expect, it } from "vitest";
import { saidBy } from "../src/lib/awsfiles";
import { textOf } from "../src/lib/filetext";
import { droppedOf } from "../src/tab/dropped";

const REWARD = "# Größe\ndef reward_function(params):\n    return 1.0\n";
const latin = (text: string) => Uint8Array.from(text, (one) => one.charCodeAt(0));
const sixteen = (text: string, isLittle: boolean) => {
  const bytes = new DataView(new ArrayBuffer(2 * text.length + 2));
  [...`\ufeff${text}`].forEach((one, index) => bytes.setUint16(2 * index, one.charCodeAt(0), isLittle));
  return new Uint8Array(bytes.buffer);
};

describe("the text of a file", () => {
  it("is read in UTF-8 and in UTF-16 with its mark, without the mark", () => {
    expect(textOf(new TextEncoder().encode(`\ufeff${REWARD}`))).toBe(REWARD);
    for (const isLittle of [true, false]) expect(textOf(sixteen(REWARD, isLittle))).toBe(REWARD);
  });

  it("is read in what its coding line says, which says UTF-8 afterwards", () => {
    for (const coding of ["latin-1", "cp1252", "ISO_8859_15"])
      expect(textOf(latin(`#!python\n# -*- coding: ${coding} -*-\n${REWARD}`))).toBe(
        `#!python\n# -*- coding: utf-8 -*-\n${REWARD}`,
      );
  });

  it("is not guessed", () => {
    expect(textOf(latin(REWARD))).toBeUndefined();
    expect(textOf(latin(`# coding: koi8-r\n${REWARD}`))).toBeUndefined();
    expect(textOf(sixteen(REWARD, true).subarray(0, 41))).toBeUndefined();
  });

  it("fills in a new model where it can be read, and is refused in a sentence otherwise", () => {
    expect(saidBy("reward.py", sixteen(REWARD, true).buffer)).toEqual({ source: REWARD });
    expect(() => saidBy("reward.py", latin(REWARD).buffer)).toThrow("file_no_text");
  });

  it("is a reward that is dropped on the tab, where it can be read", async () => {
    const dropped = (bytes: Uint8Array<ArrayBuffer>) => droppedOf(new File([bytes], "reward_function.py"));
    expect(await dropped(sixteen(REWARD, true))).toEqual({ kind: "reward", source: REWARD });
    expect(await dropped(latin(REWARD))).toBeUndefined();
  });
});
