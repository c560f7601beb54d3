/** Whether the console answers. What is asked while it does not waits, and is asked again when it does. */
const PROBE = 1500; // ms between two attempts

export const connection = $state({
  /** Since when there was no answer, in ms; 0 while there are answers. */
  lostAt: 0,
  /** The console answers, but does not know this browser. */
  isStranger: false,
});

let waiting: (() => void)[] = [];
let timer: ReturnType<typeof setTimeout> | undefined;

/** There was no answer. */
export function lost(): void {
  if (connection.lostAt) return;
  connection.lostAt = Date.now();
  timer = setTimeout(() => void probe(), PROBE);
}

/** There was an answer. */
export function found(): void {
  clearTimeout(timer);
  connection.lostAt = 0;
  const released = waiting;
  waiting = [];
  for (const go of released) go();
}

/** Comes when the console answers again. */
export const back = (): Promise<void> => new Promise((resolve) => waiting.push(resolve));

/** Ask whether anybody is there, as whoever hears nothing any more does. */
export async function probe(): Promise<void> {
  try {
    await fetch("/api/console");
    found();
  } catch {
    lost();
    clearTimeout(timer);
    timer = setTimeout(() => void probe(), PROBE);
  }
}
