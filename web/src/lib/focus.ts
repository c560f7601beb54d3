/** Where the keyboard goes on when what had the focus is gone, as a question is once it was answered. */
import { tick } from "svelte";

/** On to what is found then, such as what had asked, or to the page's content. Who is elsewhere already stays there. */
export async function goOn(find: () => HTMLElement | null | undefined = () => null): Promise<void> {
  await tick();
  const at = document.activeElement;
  if (at && at !== document.body) return;
  const there = find();
  if (there?.isConnected) there.focus();
  else document.getElementById("main")?.focus({ preventScroll: true });
}

/** For what was just asked for: `autofocus` alone leaves the keyboard where it is if what had asked is still there. */
export function focused(node: HTMLElement): void {
  node.focus();
}
