/** A site is kept in the browser once its page is there: that must not slow its first car down. */
const LATER = 3000; // ms

export function keepSoon(site: string): void {
  if ("serviceWorker" in navigator)
    setTimeout(() => void navigator.serviceWorker.register(new URL("offline.js", site)).catch(() => {}), LATER);
}
