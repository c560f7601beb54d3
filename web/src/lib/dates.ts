/** Moments as people write them, in the language of the page. */
export const moment = (iso: string): string =>
  new Intl.DateTimeFormat(document.documentElement.lang || "en", { dateStyle: "medium", timeStyle: "short" }).format(
    new Date(iso),
  );

/** What a field for date and time holds, as the moment that the server is told; nothing stays nothing. */
export const fromField = (value: string): string | null => (value ? new Date(value).toISOString() : null);

/** The time of day of a moment in ms. */
export const time = (at: number): string =>
  new Intl.DateTimeFormat(document.documentElement.lang || "en", { timeStyle: "medium" }).format(at);
