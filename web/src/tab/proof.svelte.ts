/** A replay that is being driven again, in a worker of its own: a training goes on beside it. */
import { openWorker } from "./open";
import type { Plan } from "./plan";
import { l } from "./text";
import type { Verdict } from "./verify/verify";
import type { Load, Report, Verify } from "./worker";

export class Proof {
  name = $state(""); // of the file that is being driven
  verdict = $state.raw<Verdict | undefined>();
  problem = $state("");
  file = $state.raw<File | undefined>(); // that was checked last
  private worker: Worker | undefined;

  constructor(
    private readonly site: string,
    private readonly plan: Plan,
  ) {}

  check(file: File): void {
    this.worker?.terminate();
    [this.name, this.verdict, this.problem] = [file.name, undefined, ""];
    this.file = file;
    const worker = (this.worker = openWorker());
    worker.onmessage = ({ data }: MessageEvent<Report>) => this.hear(data);
    worker.onerror = ({ message }) => this.end(l("replay_unable", { why: message || "worker" }));
    worker.postMessage({ kind: "load", site: this.site, hasPython: false, isTeam: false } satisfies Load);
    worker.postMessage({ kind: "verify", plan: this.plan, file } satisfies Verify);
  }

  private hear(report: Report): void {
    if (report.kind === "verified") {
      this.verdict = report.verdict;
      this.end("");
    } else if (report.kind === "unreadable") this.end(l(report.key, report.values));
    else if (report.kind === "failed") this.end(l("replay_unable", { why: report.message }));
  }

  private end(problem: string): void {
    this.worker?.terminate();
    [this.name, this.problem] = ["", problem];
  }
}
