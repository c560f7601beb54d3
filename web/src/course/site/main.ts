import { mount } from "svelte";
import { keepSoon, takeNewer } from "../../lib/offline";
import { applyTheme } from "../../lib/theme.svelte";
import "../../style.css";
import Lessons from "./Lessons.svelte";

applyTheme();
const site = new URL(".", location.href).href;
await takeNewer(site);
mount(Lessons, { target: document.getElementById("app")!, props: { site } });
keepSoon(site);
