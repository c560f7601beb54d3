/** Wiedergabe und Kurvenbericht. */
import type { replay as english } from "../en/replay";

export const replay: Record<keyof typeof english, string> = {
  reward_own: "Belohnung je Schritt",
  reward_of_model:
    "Was die eigene Belohnungsfunktion dieses Modells entlang der Runde zahlt; beim Geist ist es dessen eigene.",
  reward_of_stretch:
    "Was die Belohnung von Abschnitt {number}, der hier fuhr, entlang der Runde zahlt; beim Geist ist es dessen eigene.",
  reward_afresh:
    "Die Funktion merkt sich frühere Schritte; hier wurde sie neu aufgerufen, im Training kann sie anders gezahlt haben.",
  keep: "Als Datei behalten oder als Tabelle sehen",
  camera: "Kamera",
  camera_driver: "Fahrersicht",
  replay: "Wiederholung",
  replay_lead:
    "Zieh am Regler oder klick in eine Kurve: Autos, Linie und Kurven zeigen denselben Moment. Mit Geistern wird es ein Rennen.",
  ghosts: "Gezeigte Autos",
  ghost_add: "Geist dazu",
  ghost_remove: "Geist entfernen",
  ghost_laps: "Runden dieser Auswertung",
  ghost_races: "Andere Auswertungen und Zwischenstände",
  ghost_models: "Andere Modelle auf dieser Strecke",
  ghost_step: "Stand nach {step} Schritten",
  line_by_speed: "Ideallinie nach Tempo",
  play: "Abspielen",
  pause: "Anhalten",
  play_pace: "Tempo der Wiederholung",
  moment: "Moment der Runde",
  time_delta: "Rückstand auf die gewählte Runde, s",
  corner_report: "Kurven",
  corner_lead:
    "Runde {lap} gegen die beste Durchfahrt der {count} {count|gefahrenen Runde|gefahrenen Runden}. Jede Kurve in Bestzeit ergäbe {ideal}.",
  corner: "Kurve",
  corner_best: "Beste",
  corner_lost: "Verloren",
  corner_entry: "Hinein, m/s",
  corner_slowest: "Langsamste, m/s",
  corner_exit: "Heraus, m/s",
  show_there: "Zeigen",
  results: "Ergebnisse",
  checkpoint: "Zwischenstand",
  last: "Letzter",
  crashes: "Unfälle",
};
