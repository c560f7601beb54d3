import { mount } from "svelte";
import { keepSoon, takeNewer } from "../lib/offline";
import { applyTheme } from "../lib/theme.svelte";
import "../style.css";
import { read, type Plan } from "./plan";
import Tab from "./Tab.svelte";

applyTheme();
const site = new URL(".", location.href).href;
await takeNewer(site);
const target = document.getElementById("app")!;
try {
  const plan = (await (await read(site, "data/plan.json")).json()) as Plan;
  mount(Tab, { target, props: { site, plan, onready: () => keepSoon(site) } });
} catch (error) {
  target.textContent = (error as Error).message; // rather than nothing at all
  throw error;
}
