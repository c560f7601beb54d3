/** The reward that is being written, which outlives the page. */
const KEY = "racecraft-tab-reward";

const BEGINNING = `def reward_function(params):
    """Stay near the middle, and hurry."""
    share = params["distance_from_center"] / (0.5 * params["track_width"])
    return max(1 - share, 0.001) * params["speed"]
`;

export function read(): string {
  try {
    return localStorage.getItem(KEY) ?? BEGINNING;
  } catch {
    return BEGINNING; // this browser keeps nothing
  }
}

export function keep(source: string): void {
  try {
    localStorage.setItem(KEY, source);
  } catch {
    // full: the page still has it
  }
}
