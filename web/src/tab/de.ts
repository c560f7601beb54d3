/** German texts of the page in a tab. */
import type { TabKey } from "./en";

export const de: Record<TabKey, string> = {
  title: "Sieh zu, wie ein Auto fahren lernt",
  lead: "Wähle, wofür es belohnt wird, und drücke Trainieren: 64 Autos fahren nach Kamerabildern, in diesem Tab. Nichts verlässt ihn.",
  track: "Strecke",
  reward: "Wofür es belohnt wird",
  source: "Die Belohnung in Python",
  train: "Trainieren",
  stop: "Anhalten",
  loading: "Der Simulator wird geladen …",
  learning: "{count} Autos lernen zugleich",
  ready: "64 Autos warten auf dich.",
  reached: "Es fährt {laps} von {laps} Runden nach {time}.",
  unreached: "{time}, und es fährt noch nicht jede Runde. Eine andere Belohnung oder Strecke ist vielleicht leichter.",
  stopped: "Angehalten nach {time}.",
  laps: "Runden",
  laps_of: "{laps} von {trials}",
  slow: "Diesem Browser oder Rechner fehlt eine verschmolzene Multiplikation mit Addition: Das Lernen ergibt dieselben Zahlen, dauert aber viel länger.",
  unable: "Dieser Browser kann den Simulator nicht ausführen: {why}",
  models: "Deine Modelle",
  models_lead:
    "Sie bleiben in diesem Browser. Ein Download geht im installierten Programm weiter: racecraft import DATEI, dann racecraft train --resume.",
  models_none: "Noch keines. Ein Auto, das trainiert und bewertet wurde, steht dann hier.",
  model_about: "{track}, {laps} von 5 Runden, beste {lap}, {steps} Schritte",
  download: "Herunterladen",
  drop: "Löschen",
  full: "Im Speicher dieses Browsers ist kein Platz mehr: Lösche ein Modell, oder lade dieses jetzt herunter.",
  installed: "Alles andere, etwa eine eigene Belohnung, gibt es im installierten Programm.",
};
