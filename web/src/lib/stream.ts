/** A model's live events. They go on where they broke off, however long the server was away or what it answered. */
import type { JobInfo } from "../api/client";
import type { Point } from "./curves";
import type { Look, Picture } from "../scene/poses";

export interface Handlers {
  points: (points: Point[]) => void;
  live: (look: Look) => void;
  jobs: (jobs: JobInfo[]) => void;
  /** Asked of the server only where it is given. */
  eye?: (picture: Picture) => void;
  /** The connection broke off. */
  broken?: () => void;
}

export const RETRY = 2000; // ms

/** Follow until the returned function is called; not while the page is hidden, as a browser has six connections to a server. */
export function followModel(run: string, on: Handlers, open = (url: string) => new EventSource(url)): () => void {
  let offset = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let source: EventSource | undefined;
  const connect = () => {
    const mine = (source = open(`/api/events/${encodeURIComponent(run)}?offset=${offset}${on.eye ? "&eye=true" : ""}`));
    mine.addEventListener("points", (event) => {
      offset = Number(event.lastEventId) || offset;
      on.points(JSON.parse(event.data) as Point[]);
    });
    mine.addEventListener("live", (event) => on.live(JSON.parse(event.data) as Look));
    mine.addEventListener("eye", (event) => on.eye?.(JSON.parse(event.data) as Picture));
    mine.addEventListener("jobs", (event) => on.jobs(JSON.parse(event.data) as JobInfo[]));
    mine.onerror = () => {
      on.broken?.();
      // A broken connection is opened again by the browser, with Last-Event-ID; after an error reply it gives up.
      if (mine.readyState === 2) timer = setTimeout(connect, RETRY);
    };
  };
  const close = () => {
    clearTimeout(timer);
    source?.close();
  };
  const turn = () => {
    close();
    if (!document.hidden) connect();
  };
  document.addEventListener("visibilitychange", turn);
  turn();
  return () => {
    document.removeEventListener("visibilitychange", turn);
    close();
  };
}
