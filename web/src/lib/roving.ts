/** Arrow keys within a group of which one is chosen, as tabs and radio buttons are expected to be driven. */
const STEPS: Record<string, number> = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 };

/** Which of so many a key leads to, from one of them; nothing where it does not belong here. */
export function next(key: string, from: number, count: number): number | undefined {
  if (key === "Home") return 0;
  if (key === "End") return count - 1;
  const step = STEPS[key];
  return step === undefined || count === 0 ? undefined : (from + step + count) % count;
}

/** For a group's onkeydown: choose and focus the member that the key leads to. */
export function rove(event: KeyboardEvent): void {
  const group = event.currentTarget as HTMLElement;
  const members = [...group.querySelectorAll<HTMLElement>('[role="tab"], [role="radio"]')];
  const to = next(event.key, members.indexOf(event.target as HTMLElement), members.length);
  if (to === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  members[to]!.click();
  members[to]!.focus();
}
