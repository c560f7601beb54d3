/** Einstellungen mal Startwerte. */
import type { sweeps as english } from "../en/sweeps";

export const sweeps: Record<keyof typeof english, string> = {
  sweeps: "Reihen",
  sweeps_lead:
    "Welche von mehreren Einstellungen besser ist und welche nur Glück hatte: Jede wird mit denselben Startwerten trainiert.",
  sweeps_missing: "Es gibt keine Reihe {name}; vielleicht wurde sie gelöscht.",
  sweeps_new: "Neue Reihe",
  sweeps_name: "Name",
  sweeps_text: "Was trainiert werden soll",
  sweeps_text_lead:
    "Unter [all] steht, was alle Trainings haben, unter [settings.…], was jede Einstellung dazu hat. Eine Belohnung ist eine Vorlage oder die eines Modells; numbers sind Hyperparameter und Konstanten der Belohnung.",
  sweeps_start: "Reihe starten",
  sweeps_size: "{settings} {settings|Einstellung|Einstellungen} × {seeds} {seeds|Startwert|Startwerte}",
  sweeps_goal_laps: "wenigste Schritte, bis alle Runden gefahren sind",
  sweeps_goal_lap_time: "schnellste Runde",
  sweeps_done: "{done} von {all} trainiert",
  sweeps_go_on: "Den Rest trainieren",
  sweeps_removed: "Die Reihe {name} wurde gelöscht; ihre Modelle bleiben.",
  sweeps_board: "Rangliste",
  sweeps_board_lead:
    "Das Mittel über die Startwerte; der Balken enthält das wahre Mittel mit 95 %. Mehr Startwerte machen ihn schmaler. „Gleichauf“ könnte so gut sein wie die erste.",
  sweeps_setting: "Einstellung",
  sweeps_laps_after: "Alle Runden nach, Schritte",
  sweeps_range: "{mean} ({low} bis {high})",
  sweeps_came: "{count} von {all} {all|Startwert|Startwerten} {count|kam|kamen} so weit",
  sweeps_tied: "gleichauf",
  sweeps_runs: "Trainings",
  sweeps_seed: "Startwert {seed}",
  sweeps_state_waiting: "nicht begonnen",
  sweeps_state_queued: "wartet",
  sweeps_state_running: "trainiert",
  sweeps_state_done: "fertig",
  sweeps_state_stopped: "angehalten",
  sweeps_state_failed: "gescheitert",
};
