/** Warum eine Runde schneller ist als eine andere. */
import type { why as english } from "../en/why";

export const why: Record<keyof typeof english, string> = {
  why_than: "Warum ist {who} schneller als {whom}?",
  why_lead: "Kurve für Kurve, nach {lap}: zuerst, was am meisten Zeit brachte oder kostete.",
  why_laps: "der schnellsten Runde von beiden",
  why_shown: "den beiden oben gewählten Runden",
  why_faster: "{who} ist über die Runde {seconds} s schneller als {whom}.",
  why_same: "{who} und {whom} brauchen gleich lang.",
  why_brakes: "{who} bremst vor Kurve {corner} {amount} m später",
  why_lifts: "{who} braucht vor Kurve {corner} nicht zu bremsen",
  why_arrives: "{who} ist auf dem Weg zu Kurve {corner} {amount} m/s schneller",
  why_middle: "{who} ist mitten in Kurve {corner} {amount} m/s schneller",
  why_accelerates: "{who} beschleunigt aus Kurve {corner} {amount} m früher",
  why_leaves: "{who} ist aus Kurve {corner} heraus {amount} m/s schneller",
  why_way: "{who} fährt durch Kurve {corner} eine um {amount} m kürzere Linie",
  why_puts: "{who} kommt ohne Zurücksetzen durch Kurve {corner}, {whom} nicht",
  why_fewer: "{who} wird in Kurve {corner} seltener zurückgesetzt als {whom}",
  why_pace: "{who} ist schneller durch Kurve {corner}",
  why_close: "In keiner Kurve unterscheiden sie sich um mehr als 0,02 s.",
  why_none: "Um zu sagen, warum, brauchen beide eine ganze Runde in einer Auswertung auf derselben Strecke.",
  why_button: "Warum?",
  gaps: "Zeit hinter {who}, s",
  gaps_place: "Meter vom Start",
  gaps_behind: "{who} liegt bis zu {time} zurück.",
  gaps_ahead: "{who} liegt bis zu {time} vorn.",
  gaps_whole: "Alles zeigen",
};
