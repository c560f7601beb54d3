import { mount } from "svelte";
import { applyTheme } from "../lib/theme.svelte";
import "../style.css";
import { read, type Plan } from "./plan";
import Tab from "./Tab.svelte";

applyTheme();
const site = new URL(".", location.href).href;
const plan = (await (await read(site, "data/plan.json")).json()) as Plan;
mount(Tab, { target: document.getElementById("app")!, props: { site, plan } });

// once the page is there: keeping the site for later must not slow its first car down
const LATER = 3000; // ms
if ("serviceWorker" in navigator)
  setTimeout(() => void navigator.serviceWorker.register(new URL("offline.js", site)).catch(() => {}), LATER);
