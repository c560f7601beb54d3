/** Rahmen und was alle Seiten teilen. */
import type { shell as english } from "../en/shell";

export const shell: Record<keyof typeof english, string> = {
  garage: "Garage",
  create: "Neues Modell",
  tracks: "Strecken",
  settings: "Einstellungen",
  garage_brief: "Garage",
  create_brief: "Neu",
  tracks_brief: "Strecken",
  races_brief: "Rennen",
  settings_brief: "Optionen",
  skip: "Zum Inhalt",
  theme: "Aussehen",
  theme_system: "Wie das System",
  theme_light: "Hell",
  theme_dark: "Dunkel",
  language: "Sprache",
  close: "Schließen",
  loading: "Lädt …",
  x_place: "Ort auf der Strecke, m",
  x_seconds: "Sekunden",
  x_minutes: "Minuten",
};
