/** Frame and what all pages share. */
export const shell = {
  garage: "Garage",
  create: "New model",
  tracks: "Tracks",
  settings: "Settings",
  skip: "Skip to content",
  theme: "Theme",
  theme_system: "As the system",
  theme_light: "Light",
  theme_dark: "Dark",
  language: "Language",
  close: "Close",
  loading: "Loading…",
  x_place: "Place on the track, m",
  x_seconds: "Seconds",
  x_minutes: "Minutes",
} as const;
