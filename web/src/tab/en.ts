/** English texts of the page in a tab, beside those that it shares with the console: the complete catalogue. */
export const en = {
  title: "Watch a car learn to drive",
  lead: "Choose what it is paid for and press Train: sixty-four cars drive from camera pixels, in this tab. Nothing leaves it.",
  track: "Track",
  reward: "What it is paid for",
  source: "The reward in Python",
  train: "Train",
  stop: "Stop",
  loading: "Loading the simulator …",
  learning: "{count} cars learning at once",
  ready: "64 cars wait for you.",
  reached: "It drives {laps} of {laps} laps after {time}.",
  unreached: "{time}, and it does not drive every lap yet. Another reward or track may be easier.",
  stopped: "Stopped after {time}.",
  laps: "Laps",
  laps_of: "{laps} of {trials}",
  slow: "This browser or machine has no fused multiply-add: learning gives the same numbers, but many times slower.",
  unable: "This browser cannot run the simulator: {why}",
  models: "Your models",
  models_lead:
    "They stay in this browser. A download goes on in the installed program: racecraft import FILE, then racecraft train --resume.",
  models_none: "Nothing yet. A car that has been trained and judged is kept here.",
  model_about: "{track}, {laps} of 5 laps, best {lap}, {steps} steps",
  download: "Download",
  drop: "Delete",
  full: "There is no room left in this browser's storage: delete a model, or download this one now.",
  installed: "Everything else, such as a reward of your own, is in the installed program.",
} as const;

export type TabKey = keyof typeof en;
