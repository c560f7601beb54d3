/** Auswertungen. */
import type { evaluation as english } from "../en/evaluation";

export const evaluation: Record<keyof typeof english, string> = {
  race_lead: "Gegen die Uhr nach den Regeln der Liga: Neben der Strecke kostet es Sekunden.",
  laps: "Runden",
  trials: "Versuche",
  start_race: "Rennen starten",
  racing: "Fährt …",
  no_races: "Noch kein Rennen.",
  result: "Ergebnis",
  clean_laps: "Fehlerfreie Runden",
  clean_interval: "95-%-Intervall {low} bis {high}",
  mean_lap: "Mittlere Runde",
  off_track: "Neben der Strecke",
  resets: "Zurückgesetzt",
  penalty: "Strafe",
  trial: "Runde",
  status: "Status",
  video: "Video",
  racing_line: "Ideallinie",
  telemetry: "Telemetrie",
  telemetry_lead: "Nach dem Ort auf der Strecke, damit man Runden vergleichen kann.",
  lap: "Runde",
  train_first: "Trainiere das Modell zuerst: Noch gibt es nichts, womit es fahren könnte.",
};
