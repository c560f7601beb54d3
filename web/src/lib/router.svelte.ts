/** Pages by address: /, /create, /models/NAME, /models/NAME/race, /tracks, /settings. */
export const route = $state({ path: location.pathname });

export function go(path: string): void {
  if (path !== location.pathname) history.pushState(null, "", path);
  route.path = path;
  scrollTo(0, 0);
  document.getElementById("main")?.focus({ preventScroll: true });
}

addEventListener("popstate", () => (route.path = location.pathname));

/** What an address is made of; one that cannot be read is of no page. */
export function partsOf(path: string): string[] {
  try {
    return path.split("/").filter(Boolean).map(decodeURIComponent);
  } catch {
    return [path];
  }
}

/** A click on a link of ours changes the page without loading it anew. */
export function follow(event: MouseEvent): void {
  const link = (event.target as Element).closest("a");
  if (!link || event.defaultPrevented || event.button !== 0 || event.metaKey || event.ctrlKey || event.shiftKey) return;
  if (link.origin !== location.origin || link.target || link.hasAttribute("download")) return;
  if (link.pathname.startsWith("/api/")) return;
  event.preventDefault();
  go(link.pathname);
}
