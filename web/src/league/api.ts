/** The routes of a league. */
import { ask } from "../api/client";
import type { RaceReplay } from "../api/races";
import type { components } from "../api/schema";
import { carsShown, nameShown, namesShown } from "./names";
import type { Me } from "./who.svelte";

type Schemas = components["schemas"];
export type GroupCard = Schemas["GroupCard"];
export type GroupDetail = Schemas["GroupDetail"];
export type MemberInfo = Schemas["MemberInfo"];
export type MemberModels = Schemas["MemberModels"];
export type MemberLessons = Schemas["MemberLessons"];
export type JoiningInfo = Schemas["JoiningInfo"];
export type LoginCard = Schemas["LoginCard"];
export type NewLeagueRace = Schemas["NewLeagueRace"];
/** What the page of a new race asks for; all else is as every race has it. */
export type RaceWishes = Pick<
  NewLeagueRace,
  | ("description" | "kind" | "track" | "direction" | "laps" | "ranking" | "minimum_laps" | "offtrack_penalty")
  | ("collision_penalty" | "max_resets" | "objects" | "bot_speed" | "vehicle" | "trials" | "seed")
>;
export type LeagueRace = Schemas["LeagueRace"];
export type BoardPage = Schemas["BoardPage"];
export type BoardRow = Schemas["BoardRow"];
export type FinalPage = Schemas["FinalPage"];
export type SubmissionInfo = Schemas["SubmissionInfo"];
export type CommentInfo = Schemas["CommentInfo"];
export type SeasonRow = Schemas["SeasonRow"];
export type SessionInfo = Schemas["SessionInfo"];
export type AuditLine = Schemas["AuditLine"];
export type ResetLink = Schemas["ResetLink"];
export type GroupQuota = Schemas["GroupQuota"];
export type OwnQuota = Schemas["OwnQuota"];
export type QuotaInfo = Schemas["QuotaInfo"];
export type UsageInfo = Schemas["UsageInfo"];
export type ProviderLink = Schemas["ProviderLink"];
export type TokenInfo = Schemas["TokenInfo"];

const finalistsShown = (page: FinalPage): FinalPage => ({ ...page, finalists: namesShown(page.finalists) });

/** Who has no name yet is called so in all that is read here, but on their own card. */
export const leagueApi = {
  signIn: (name: string, password: string) => ask<Me>("POST", "/door/sign-in", { name, password }),
  showCard: (secret: string) => ask<Me>("POST", "/door/card", { secret }),
  join: (code: string, name: string) => ask<Schemas["Joined"]>("POST", "/door/join", { code, name }),
  resetPassword: (secret: string, password: string) => ask<Me>("POST", "/door/reset", { secret, password }),
  toProvider: () => ask<Schemas["ToProvider"]>("POST", "/door/provider"),
  arrive: (answer: Schemas["FromProvider"]) => ask<Schemas["Arrived"]>("POST", "/door/provider/arrival", answer),
  joinByProvider: (name: string) => ask<Me>("POST", "/door/provider/newcomer", { name }),
  letIn: (code: string) => ask<void>("POST", "/account/devices", { code }),
  makeReset: (person: string) => ask<ResetLink>("POST", "/resets", { person }),
  audit: (query: Record<string, string | number>) =>
    ask<AuditLine[]>(
      "GET",
      `/audit?${new URLSearchParams(Object.entries(query).map(([key, one]) => [key, String(one)]))}`,
    ),
  signOut: () => ask<void>("POST", "/door/sign-out"),
  joinOn: (code: string) => ask<GroupCard>("POST", "/groups/join", { code }),

  groups: () => ask<GroupCard[]>("GET", "/groups"),
  group: (id: number) =>
    ask<GroupDetail>("GET", `/groups/${id}`).then((found) => ({ ...found, members: namesShown(found.members) })),
  changeGroup: (id: number, change: Partial<Schemas["GroupChange"]>) => ask<void>("PATCH", `/groups/${id}`, change),
  makeGroup: (title: string) => ask<GroupCard>("POST", "/groups", { title }),
  open: (id: number, uses: number, hours: number) => ask<JoiningInfo>("POST", `/groups/${id}/joining`, { uses, hours }),
  close: (id: number) => ask<void>("DELETE", `/groups/${id}/joining`),
  add: (id: number, people: { name: string; real_name: string }[]) =>
    ask<LoginCard[]>("POST", `/groups/${id}/members`, { people }),
  changeMember: (id: number, member: number, change: { name?: string; real_name?: string }) =>
    ask<void>("PATCH", `/groups/${id}/members/${member}`, change),
  removeMember: (id: number, member: number) => ask<void>("DELETE", `/groups/${id}/members/${member}`),
  revoke: (id: number, member: number) => ask<void>("POST", `/groups/${id}/members/${member}/revoke`),
  admit: (id: number, member: number) => ask<void>("POST", `/groups/${id}/members/${member}/admit`),
  cards: (id: number, members: number[]) => ask<Schemas["PrintedCards"]>("POST", `/groups/${id}/cards`, { members }),
  quota: () => ask<OwnQuota>("GET", "/quota"),
  groupQuota: (id: number) => ask<GroupQuota>("GET", `/groups/${id}/quota`),
  setGroupQuota: (id: number, each: QuotaInfo) => ask<void>("PUT", `/groups/${id}/quota`, each),
  lessons: (id: number) => ask<Schemas["MemberLessons"][]>("GET", `/groups/${id}/lessons`).then(namesShown),
  models: (id: number) => ask<MemberModels[]>("GET", `/groups/${id}/models`).then(namesShown),
  copy: (id: number, member: number, model: string) =>
    ask<Schemas["ModelCard"]>("POST", `/groups/${id}/models/copy`, { member, model }),
  comments: () => ask<CommentInfo[]>("GET", "/comments"),
  memberComments: (id: number, member: number) => ask<CommentInfo[]>("GET", `/groups/${id}/comments?member=${member}`),
  comment: (id: number, member: number, model: string, text: string) =>
    ask<CommentInfo[]>("POST", `/groups/${id}/comments`, { member, model, text }),
  removeComment: (comment: number) => ask<void>("DELETE", `/comments/${comment}`),
  invite: () => ask<JoiningInfo>("POST", "/invitations", { uses: 1, hours: 24 * 7 }),

  races: () => ask<LeagueRace[]>("GET", "/league/races"),
  makeRace: (group: number, race: Partial<NewLeagueRace> & { title: string }) =>
    ask<LeagueRace>("POST", `/groups/${group}/races`, race),
  changeRace: (id: number, change: Partial<Schemas["LeagueRaceChange"]>) =>
    ask<LeagueRace>("PATCH", `/league/races/${id}`, change),
  follow: (id: number, race: number, best: number) =>
    ask<LeagueRace>("POST", `/league/races/${id}/follow`, { race, best }),
  final: (id: number) => ask<FinalPage>("GET", `/boards/${id}/final`).then(finalistsShown),
  hold: (id: number) => ask<FinalPage>("POST", `/league/races/${id}/hold`).then(finalistsShown),
  duelFilm: (id: number, duel: number, heat: number) =>
    ask<RaceReplay>("GET", `/boards/${id}/duels/${duel}/heats/${heat}/film`).then(carsShown),
  season: (group: number) => ask<SeasonRow[]>("GET", `/groups/${group}/season`).then(namesShown),
  judgeAgain: (id: number, submission: number) =>
    ask<unknown>("POST", `/league/races/${id}/submissions/${submission}/judge`),
  removeRace: (id: number) => ask<void>("DELETE", `/league/races/${id}`),
  boardSeason: (id: number) => ask<SeasonRow[]>("GET", `/boards/${id}/season`).then(namesShown),
  board: (id: number, top: number) =>
    ask<BoardPage>("GET", `/boards/${id}?top=${top}`).then((page) => ({ ...page, rows: namesShown(page.rows) })),
  film: (id: number, submissions: number[]) =>
    ask<RaceReplay>("GET", `/boards/${id}/film?submissions=${submissions.join(",")}`).then(carsShown),
  enter: (id: number, model: string) => ask<SubmissionInfo>("POST", `/league/races/${id}/enter`, { model }),
  submissions: (id: number, everybody: boolean) =>
    ask<SubmissionInfo[]>("GET", `/league/races/${id}/submissions?everybody=${everybody}`).then((found) =>
      namesShown(found).map((one) => ({ ...one, like: one.like && { ...one.like, name: nameShown(one.like.name) } })),
    ),
  renameModel: (id: number, submission: number, model: string) =>
    ask<void>("PATCH", `/league/races/${id}/submissions/${submission}`, { model }),
  disqualify: (id: number, submission: number, reason: string) =>
    ask<void>("POST", `/league/races/${id}/submissions/${submission}/disqualify`, { reason }),
  accept: (id: number, submission: number) => ask<void>("POST", `/league/races/${id}/submissions/${submission}/accept`),
  restore: (id: number, submission: number) =>
    ask<void>("POST", `/league/races/${id}/submissions/${submission}/restore`),

  rename: (name: string) => ask<Me>("PATCH", "/account", { name }),
  setPassword: (old: string, fresh: string) => ask<void>("PUT", "/account/password", { old, new: fresh }),
  provider: () => ask<ProviderLink | null>("GET", "/account/provider"),
  linkProvider: () => ask<Schemas["ToProvider"]>("POST", "/account/provider"),
  unlinkProvider: () => ask<void>("DELETE", "/account/provider"),
  sessions: () => ask<SessionInfo[]>("GET", "/account/sessions"),
  endSession: (id: string) => ask<void>("DELETE", `/account/sessions/${id}`),
  endSessions: () => ask<void>("DELETE", "/account/sessions"),
  tokens: () => ask<TokenInfo[]>("GET", "/account/tokens"),
  makeToken: (title: string, days: number, isWorker: boolean) =>
    ask<Schemas["MadeToken"]>("POST", "/account/tokens", {
      title,
      days,
      scopes: isWorker ? ["worker"] : ["read", "submit"],
    }),
  removeToken: (id: number) => ask<void>("DELETE", `/account/tokens/${id}`),
  removeAccount: (password: string) => ask<void>("DELETE", "/account", { password }),
};
