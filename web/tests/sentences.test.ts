import { describe, expect, it } from "vitest";
import errors from "../src/i18n/de/errors.json";
import { translator as of, type Sentences } from "../src/i18n/sentences";
import { fixed } from "../src/lib/numbers";

const translator = (sentences: Sentences) => of(sentences, fixed);

describe("what the server says, in another language", () => {
  const say = translator({
    "There is no model {}.": "Es gibt kein Modell {}.",
    "{} cannot be read: {}.": "{} ist nicht lesbar: {}.",
    "{} cannot be read: its file is gone.": "{} ist nicht lesbar: Die Datei ist weg.",
    "Entry {} of race {}.": "Im Rennen {1} die Meldung {0}.",
    "a whole number from {} to {}": "eine ganze Zahl von {} bis {}",
    "{} is {}; allowed is {}.": "{} ist {}; erlaubt ist {}.",
  });

  it("keeps what is filled in, wherever the other language has it", () => {
    expect(say("There is no model 'a.b'.")).toBe("Es gibt kein Modell 'a.b'.");
    expect(say("Entry 3 of race 'x y'.")).toBe("Im Rennen 'x y' die Meldung 3.");
    expect(say("There is no model '$& {0} {}'.")).toBe("Es gibt kein Modell '$& {0} {}'.");
  });

  it("takes the sentence that says most, and says what is filled in, too", () => {
    expect(say("x cannot be read: its file is gone.")).toBe("x ist nicht lesbar: Die Datei ist weg.");
    expect(say("x cannot be read: There is no model 7..")).toBe("x ist nicht lesbar: Es gibt kein Modell 7..");
    expect(say("laps is 0; allowed is a whole number from 1 to 9.")).toBe(
      "laps ist 0; erlaubt ist eine ganze Zahl von 1 bis 9.",
    );
  });

  it("goes line by line, and leaves alone what it does not know", () => {
    expect(say("    reward = 1\nThere is no model x.")).toBe("    reward = 1\nEs gibt kein Modell x.");
    expect(say("Something else.")).toBe("Something else.");
    expect(say("")).toBe("");
  });

  it("takes no time over a stranger's text", () => {
    const german = translator(errors);
    const before = performance.now();
    for (const text of [": ".repeat(5000), "is ; allowed are ".repeat(30), ", line ".repeat(80)]) german(text);
    expect(performance.now() - before).toBeLessThan(2000);
  });

  it("says what a pupil meets", () => {
    const german = translator(errors);
    expect(german("reward.py, line 3: the reward function raised KeyError: 'sped'.")).toBe(
      "reward.py, Zeile 3: Die Belohnungsfunktion löste KeyError: 'sped' aus.",
    );
    expect(german("0.replay says it holds 40,000 bytes; allowed are 4 to 1,234,567 in a file of its size.")).toBe(
      `0.replay soll ${fixed(40_000, 0)} Byte enthalten; in einer Datei dieser Größe sind 4 bis ${fixed(1_234_567, 0)} erlaubt.`,
    );
    expect(german("Vehicle parameter mass is -5.0; allowed is a number from 0.1 to 1000.")).toBe(
      `Der Wert mass des Autos ist ${fixed(-5, 1)}; erlaubt ist eine Zahl von ${fixed(0.1, 1)} bis 1000.`,
    );
    expect(german("params has no key 'sped'.")).toBe("params hat keinen Schlüssel 'sped'.");
    expect(german("Did you mean 'speed'?")).toBe("Meintest du 'speed'?");
    expect(german("Track 'x': its centre line crosses or touches itself, near (1.2, 3.4).")).toBe(
      "Strecke 'x': Sie kreuzt oder berührt sich selbst (Mittellinie), bei (1.2, 3.4).",
    );
  });
});
