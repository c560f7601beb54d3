import { expect, test } from "vitest";
import sentences from "./de/errors.json";
import { translator } from "./sentences";

const german = translator(sentences, (value, digits) => value.toFixed(digits).replace(".", ","));

test("from where to where something is allowed is said in German wherever it stands", () => {
  const said = {
    "num_epochs is 0; allowed is 1 to 100.": "num_epochs ist 0; erlaubt ist 1 bis 100.",
    "num_epochs is missing; allowed is 1 to 100.": "num_epochs fehlt; erlaubt ist 1 bis 100.",
    "A grid race is of 2 to 8 models; this one has 1.": "Ein Rennen der Art grid hat 2 bis 8 Modelle; dieses hat 1.",
    "hyperparameters.json: num_epochs is 0; allowed is 1 to 100; batch_size is 9999; allowed is 1 to 2048 samples.":
      "hyperparameters.json: num_epochs ist 0; erlaubt ist 1 bis 100; batch_size ist 9999; erlaubt ist 1 bis 2048 Beispiele.",
    "hyperparameters.json: lr is 1, and AWS's console allowed 1e-08 to 0.001.":
      "hyperparameters.json: lr ist 1, und die Konsole von AWS erlaubte 1e-08 bis 0,001.",
    "Action 2: steering angle is 40; allowed is -30 to 30 degrees.":
      "Action 2: steering angle ist 40; erlaubt ist -30 bis 30 Grad.",
    "speed is 9; allowed is 0.1 to 4 m/s (files of 2019 up to 12).":
      "speed ist 9; erlaubt ist 0,1 bis 4 m/s (Dateien von 2019 bis zu 12).",
    "start_position_offset is 3; allowed is 0 to 1, a share of the lap.":
      "start_position_offset ist 3; erlaubt ist 0 bis 1, ein Anteil der Runde.",
    "ent_coef is searched from 0 to 2, but ent_coef is 2; allowed is a number from 0 to 1.":
      "ent_coef wird von 0 bis 2 gesucht, aber ent_coef ist 2; erlaubt ist eine Zahl von 0 bis 1.",
  };
  for (const [english, other] of Object.entries(said)) expect(german(english)).toBe(other);
});

test("a stranger's words between two are no range", () => {
  expect(german("Model 'back to school' has no checkpoint to race with.")).toBe(
    "Modell 'back to school' hat keinen Zwischenstand, mit dem es fahren könnte.",
  );
  expect(german("back to school")).toBe("back to school");
});
