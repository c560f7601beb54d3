/** Moments as people write them, in the language of the page. */
export const moment = (iso: string): string =>
  new Intl.DateTimeFormat(document.documentElement.lang || "en", { dateStyle: "medium", timeStyle: "short" }).format(
    new Date(iso),
  );

/** The moment of an evaluation's stamp, which is in UTC. */
export function ofStamp(stamp: string): string {
  const parts = /^(\d{4})(\d\d)(\d\d)(\d\d)(\d\d)(\d\d)$/.exec(stamp);
  if (!parts) return stamp;
  const [, year, month, day, hour, minute, second] = parts;
  return moment(`${year}-${month}-${day}T${hour}:${minute}:${second}Z`);
}

/** What a field for date and time holds, as the moment that the server is told; nothing stays nothing. */
export const fromField = (value: string): string | null => (value ? new Date(value).toISOString() : null);

/** The time of day of a moment in ms. */
export const time = (at: number): string =>
  new Intl.DateTimeFormat(document.documentElement.lang || "en", { timeStyle: "medium" }).format(at);
