/** A site is kept in the browser, by public/offline.js, once its page is there: that must not slow its first car down. */
const LATER = 3000; // ms
const ANSWERED = 2000; // ms; a worker that has to start first takes some

export function keepSoon(site: string): void {
  if ("serviceWorker" in navigator)
    setTimeout(() => {
      const address = new URL("offline.js", site);
      void navigator.serviceWorker.register(address, { updateViaCache: "none" }).catch(() => {});
    }, LATER);
}

/** A newer site that was kept meanwhile waits until no tab shows the one before. Where this is the only tab, which has
 * nothing yet that would be lost, it takes over now, and the page is loaded anew: this then never returns. */
export async function takeNewer(site: string): Promise<void> {
  const waiting = (await navigator.serviceWorker?.getRegistration(site).catch(() => undefined))?.waiting;
  if (!waiting) return;
  navigator.serviceWorker.addEventListener("controllerchange", () => location.reload(), { once: true });
  const { port1, port2 } = new MessageChannel();
  const takesOver = await new Promise<boolean>((answer) => {
    port1.onmessage = ({ data }) => answer(data === true);
    setTimeout(() => answer(false), ANSWERED);
    waiting.postMessage("take over", [port2]);
  });
  if (takesOver) await new Promise(() => {});
}
