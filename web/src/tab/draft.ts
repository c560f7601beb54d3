/** The reward that is being written, which outlives the page: each tab goes on with its own, a new one with what was written last. */
import { browser, tab } from "../lib/remembered";

const KEY = "racecraft-tab-reward";

export const BEGINNING = `def reward_function(params):
    """Stay near the middle, and hurry."""
    share = params["distance_from_center"] / (0.5 * params["track_width"])
    return max(1 - share, 0.001) * params["speed"]
`;

export const read = (): string => tab.read(KEY) ?? browser.read(KEY) ?? BEGINNING;

export function keep(source: string): void {
  tab.write(KEY, source);
  browser.write(KEY, source);
}
