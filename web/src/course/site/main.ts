import { mount } from "svelte";
import { applyTheme } from "../../lib/theme.svelte";
import "../../style.css";
import Lessons from "./Lessons.svelte";

applyTheme();
const site = new URL(".", location.href).href;
mount(Lessons, { target: document.getElementById("app")!, props: { site } });

// as on the page in a tab: the whole site is kept for later once this page is there
const LATER = 3000; // ms
if ("serviceWorker" in navigator)
  setTimeout(() => void navigator.serviceWorker.register(new URL("offline.js", site)).catch(() => {}), LATER);
