/** Dark, light, or as the system says; kept in this browser. */
import { browser } from "./remembered";

export type Theme = "system" | "light" | "dark";

const KEY = "racecraft-theme";
export const theme = $state({ choice: (browser.read(KEY) ?? "system") as Theme, isDark: false });
const system = matchMedia("(prefers-color-scheme: dark)");

export function applyTheme(choice: Theme = theme.choice): void {
  theme.choice = choice;
  theme.isDark = choice === "dark" || (choice === "system" && system.matches);
  browser.write(KEY, choice);
  document.documentElement.dataset["theme"] = theme.isDark ? "dark" : "light";
}

system.addEventListener("change", () => applyTheme());

export const isCalm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** How a page scrolls to what somebody asked for. */
export const gently = () => (isCalm() ? "instant" : "smooth");
