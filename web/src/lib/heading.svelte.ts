/** What the page on show is called, where only it knows: a race's title, a group's, a lesson's. */
import { route } from "./router.svelte";

/** `path`: of the page that said so; another page's word counts no more. */
export const heading = $state({ path: "", text: "" });

/** Called by a page as it begins: its own name, once it is known. */
export function named(text: () => string | undefined): void {
  const path = route.path;
  $effect(() => {
    heading.path = path;
    heading.text = text() ?? "";
  });
}
