import { mount } from "svelte";
import { applyTheme } from "../lib/theme.svelte";
import "../style.css";
import { keepSoon } from "./offline";
import { read, type Plan } from "./plan";
import Tab from "./Tab.svelte";

applyTheme();
const site = new URL(".", location.href).href;
const plan = (await (await read(site, "data/plan.json")).json()) as Plan;
mount(Tab, { target: document.getElementById("app")!, props: { site, plan, onready: () => keepSoon(site) } });
