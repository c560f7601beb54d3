/** Says that a training has ended to whoever looks elsewhere: in the title, in a message, and by the browser if wanted. */
import { SvelteMap } from "svelte/reactivity";
import { api, type JobInfo } from "../api/client";
import { t } from "../i18n/index.svelte";
import { browser, tab } from "./remembered";
import { go, route } from "./router.svelte";
import { say } from "./toasts.svelte";

const [WATCHED, WANTED] = ["racecraft-watched", "racecraft-notify"];
const PAUSE = 3000; // ms between two questions

/** `mark`: what stands before the title until somebody looks; `isWanted`: the browser is to say it, too. */
export const notice = $state({ mark: "", isWanted: browser.read(WANTED) === "yes" && isAllowed() });

/** Run by job, of the trainings that somebody saw begin in this tab. */
const watched = new SvelteMap<string, string>(JSON.parse(tab.read(WATCHED) ?? "[]") as [string, string][]);
let timer: ReturnType<typeof setTimeout> | undefined;

function isAllowed(): boolean {
  return "Notification" in globalThis && Notification.permission === "granted";
}

export const canNotify = (): boolean => "Notification" in globalThis && Notification.permission !== "denied";

/** Ask the browser, which asks the person, whether it may say it. */
export async function want(isWanted: boolean): Promise<void> {
  const isGranted = isWanted && "Notification" in globalThis && (await Notification.requestPermission()) === "granted";
  notice.isWanted = isGranted;
  browser.write(WANTED, isGranted ? "yes" : "no");
}

/** A page shows these jobs: from now on the end of its training is said, wherever the person is then. */
export function watchJobs(jobs: JobInfo[]): void {
  for (const job of jobs) {
    if (job.kind !== "train") continue;
    if (["queued", "running"].includes(job.state)) watched.set(job.id, job.run);
    else if (watched.has(job.id)) ended(job);
  }
  remember();
}

function remember(): void {
  tab.write(WATCHED, JSON.stringify([...watched]));
  clearTimeout(timer);
  if (watched.size) timer = setTimeout(() => void look(), PAUSE);
}

async function look(): Promise<void> {
  for (const id of [...watched.keys()])
    await api
      .job(id)
      .then((job) => {
        if (!["queued", "running"].includes(job.state) && watched.has(id)) ended(job);
      })
      .catch(() => watched.delete(id)); // it is gone; what does not answer is waited for
  remember();
}

function ended(job: JobInfo): void {
  watched.delete(job.id);
  const name = job.run;
  const text = t(job.state === "done" ? "notice_done" : job.state === "failed" ? "notice_failed" : "notice_stopped", {
    name,
  });
  const path = `/models/${encodeURIComponent(name)}`;
  const isSeen = !document.hidden && route.path.startsWith(path);
  if (isSeen || job.state === "cancelled") return;
  if (document.hidden) notice.mark = job.state === "done" ? "✓" : "✕";
  say(text, { label: t("notice_open"), run: () => go(path) }, document.hidden);
  if (document.hidden && notice.isWanted && isAllowed()) {
    const told = new Notification(text, { tag: job.id });
    told.onclick = () => {
      window.focus();
      go(path);
    };
  }
}

document.addEventListener("visibilitychange", () => {
  if (!document.hidden) notice.mark = "";
});
if (watched.size) remember();
