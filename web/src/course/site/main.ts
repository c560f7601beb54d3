import { mount } from "svelte";
import { applyTheme } from "../../lib/theme.svelte";
import "../../style.css";
import { keepSoon } from "../../tab/offline";
import Lessons from "./Lessons.svelte";

applyTheme();
const site = new URL(".", location.href).href;
mount(Lessons, { target: document.getElementById("app")!, props: { site } });
keepSoon(site);
