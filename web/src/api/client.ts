/** The server's answers, typed by its own OpenAPI; every error is one `Problem`. */
import { back, connection, found, lost } from "../lib/connection.svelte";
import { learnErrors, said, t } from "../i18n/index.svelte";
import { sentAt } from "../lib/servertime";
import type { components } from "./schema";

type Schemas = components["schemas"];
export type ModelCard = Schemas["ModelCard"];
export type Demonstration = Schemas["Demonstration"];
export type Evolution = Schemas["Evolution"];
export type MedalTimes = Schemas["MedalTimes"];
export type ModelDetail = Schemas["ModelDetail"];
export type TrainingStretch = Schemas["TrainingStretch"];
export type ImportedModel = Schemas["ImportedModel"];
export type TrackFacts = Schemas["TrackFacts"];
export type TrackGeometry = Schemas["TrackGeometry"];
export type PresetPictures = Schemas["PresetPictures"];
export type RewardPreset = Schemas["RewardPreset"];
export type RewardVerdict = Schemas["RewardVerdict"];
/** Among what a reward function is tried. */
export type Tried = Partial<Omit<Schemas["RewardCheck"], "source" | "track">>;
export type RewardPainting = Schemas["RewardPainting"];
export type ActionPreset = Schemas["ActionPreset"];
export type EvaluationCard = Schemas["EvaluationCard"];
export type JobInfo = Schemas["JobInfo"];
export type NewModel = Partial<Schemas["NewModel"]>;
export type HistoryPage = Schemas["HistoryPage"];
export type EvaluationLaps = Schemas["EvaluationLaps"];
export type TrainingMaps = Schemas["TrainingMaps"];
export type SaliencyPicture = Schemas["SaliencyPicture"];
export type RoadBelief = Schemas["RoadBelief"];
export type ExportNotes = Schemas["ExportNotes"];
export type Choices = Schemas["Choices"];
export type NumberChoice = Schemas["NumberChoice"];
export type RewardLap = Schemas["RewardLap"];
export type Action = Schemas["Action"];
export type ConsoleFacts = Schemas["Console"];

export class Problem extends Error {
  constructor(
    readonly code: string,
    message: string,
    readonly hint: string,
    readonly line: number | null,
    readonly field: string | null,
  ) {
    super(message);
  }
}

export const ask = <T>(method: string, path: string, body?: unknown): Promise<T> =>
  method === "GET"
    ? look(path)
    : body === undefined
      ? send(method, path, null, undefined)
      : send(method, path, JSON.stringify(body), "application/json");

/** The same with a file as it is. */
export const askBytes = <T>(method: string, path: string, body: Blob): Promise<T> =>
  send(method, path, body, "application/octet-stream");

const looking = new Map<string, Promise<unknown>>(); // what waits for the console to answer again, once each

/** Ask for something; while nobody answers it waits, and comes when somebody does. */
function look<T>(path: string): Promise<T> {
  const answer = send<T>("GET", path, null, undefined);
  return answer.catch((error: unknown) => {
    if (!(error instanceof Problem && error.code === "Offline")) throw error;
    let later = looking.get(path) as Promise<T> | undefined;
    if (!later) {
      later = back().then(() => {
        looking.delete(path);
        return look<T>(path);
      });
      looking.set(path, later);
    }
    return later;
  });
}

async function send<T>(method: string, path: string, body: BodyInit | null, kind: string | undefined): Promise<T> {
  let reply: Response;
  try {
    reply = await fetch(`/api${path}`, { method, headers: kind === undefined ? {} : { "content-type": kind }, body });
  } catch {
    lost();
    throw new Problem("Offline", t("offline_refused"), "", null, null);
  }
  found();
  sentAt(reply.headers.get("date"));
  if (reply.status === 204) return undefined as T;
  const document = await reply.json().catch(() => null);
  if (!reply.ok) {
    const error = document?.error ?? {};
    if (error.code === "NotSignedIn") connection.isStranger = true;
    await learnErrors().catch(() => undefined); // in English, then
    throw new Problem(
      error.code ?? "Bug",
      said(error.message ?? `The console answered ${reply.status}.`),
      said(error.hint ?? ""),
      error.line ?? null,
      error.field ?? null,
    );
  }
  return document as T;
}

const name = encodeURIComponent;

export const api = {
  console: () => ask<ConsoleFacts>("GET", "/console"),
  models: () => ask<ModelCard[]>("GET", "/models"),
  model: (run: string) => ask<ModelDetail>("GET", `/models/${name(run)}`),
  demonstration: (run: string, road = 0) =>
    ask<Demonstration>("GET", `/models/${name(run)}/demonstration${road ? `?road=${road}` : ""}`),
  evolution: (run: string) => ask<Evolution>("GET", `/models/${name(run)}/evolution`),
  filmEvolution: (run: string) => ask<JobInfo>("POST", `/models/${name(run)}/evolution`),
  again: (run: string) => ask<Schemas["NewModel"]>("GET", `/models/${name(run)}/again`),
  create: (model: NewModel) => ask<ModelCard>("POST", "/models", model),
  change: (run: string, change: { name?: string; tags?: string[]; notes?: string }) =>
    ask<ModelCard>("PATCH", `/models/${name(run)}`, change),
  clone: (run: string, step?: number) =>
    ask<ModelCard>("POST", `/models/${name(run)}/clone`, step === undefined ? {} : { step }),
  bring: (starter: string) => ask<ModelCard>("POST", `/models/starters/${name(starter)}`),
  remove: (run: string) => ask<void>("DELETE", `/models/${name(run)}`),
  restore: (run: string) => ask<ModelCard>("POST", `/models/${name(run)}/restore`),
  importModel: (file: File, track?: string) =>
    askBytes<ImportedModel>(
      "POST",
      `/models/import?filename=${name(file.name)}${track ? `&track=${name(track)}` : ""}`,
      file,
    ),
  train: (run: string, change: { until?: string; reward?: string }) =>
    ask<JobInfo>("POST", `/models/${name(run)}/train`, change),
  stop: (run: string) => ask<JobInfo>("POST", `/models/${name(run)}/stop`),
  history: (run: string, offset: number) => ask<HistoryPage>("GET", `/models/${name(run)}/history?offset=${offset}`),
  tracks: () => ask<TrackFacts[]>("GET", "/tracks"),
  track: (track: string) => ask<TrackGeometry>("GET", `/tracks/${name(track)}`),
  pictures: () => ask<PresetPictures>("GET", "/rewards/pictures"),
  rewards: () => ask<RewardPreset[]>("GET", "/rewards"),
  actions: () => ask<ActionPreset[]>("GET", "/actions"),
  checkReward: (source: string, track: string, tried: Tried = {}) =>
    ask<RewardVerdict>("POST", "/rewards/check", { source, track, ...tried }),
  choices: () => ask<Choices>("GET", "/choices"),
  evaluations: (run: string) => ask<EvaluationCard[]>("GET", `/models/${name(run)}/evaluations`),
  evaluate: (run: string, request: Record<string, unknown>) =>
    ask<JobInfo>("POST", `/models/${name(run)}/evaluations`, request),
  laps: (run: string, stamp: string) => ask<EvaluationLaps>("GET", `/models/${name(run)}/evaluations/${stamp}/laps`),
  saliency: (run: string, stamp: string, lap: number, row: number, target?: number) =>
    ask<SaliencyPicture>(
      "GET",
      `/models/${name(run)}/evaluations/${stamp}/saliency?lap=${lap}&row=${row}${target === undefined ? "" : `&target=${target}`}`,
    ),
  belief: (run: string, stamp: string, lap: number, row: number) =>
    ask<RoadBelief>("GET", `/models/${name(run)}/evaluations/${stamp}/belief?lap=${lap}&row=${row}`),
  exportNotes: (run: string) => ask<ExportNotes>("GET", `/models/${name(run)}/export`),
  maps: (run: string, first: number, last: number) =>
    ask<TrainingMaps>("GET", `/models/${name(run)}/maps?first=${first}&last=${last}`),
  job: (id: string) => ask<JobInfo>("GET", `/jobs/${id}`),
};

/** Address of a model as one tar.gz, weights included. */
export const archiveOf = (run: string) => `/api/models/${name(run)}/archive`;

/** Address of a model as the archive of a physical car, or as ONNX. */
export const exportedOf = (run: string, target: "car" | "onnx", checkpoint: string) =>
  `/api/models/${name(run)}/export/${target}?checkpoint=${checkpoint}`;

/** Address of a model's report. */
export const reportOf = (run: string) => `/api/models/${name(run)}/report`;

/** Address of an evaluation. */
export const evaluationOf = (run: string, stamp: string) => `/api/models/${name(run)}/evaluations/${stamp}`;

/** Address of one of a model's files. */
export const fileOf = (run: string, path: string) =>
  `/api/models/${name(run)}/files/${path.split("/").map(encodeURIComponent).join("/")}`;
