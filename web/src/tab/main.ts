import { mount } from "svelte";
import { keepSoon, takeNewer } from "../lib/offline";
import { applyTheme } from "../lib/theme.svelte";
import "../style.css";
import { read, type Plan } from "./plan";
import Tab from "./Tab.svelte";

applyTheme();
const site = new URL(".", location.href).href;
await takeNewer(site);
const plan = (await (await read(site, "data/plan.json")).json()) as Plan;
mount(Tab, { target: document.getElementById("app")!, props: { site, plan, onready: () => keepSoon(site) } });
