/** Python in this thread, for a reward of one's own; the other side is src/racecraft/site/calls.py. */
import type { PyodideAPI } from "pyodide";
import type { PyBuffer, PyProxy } from "pyodide/ffi";
import type { RewardVerdict } from "../api/client";
import { read, type TrackFile } from "./plan";

/** Rewards of the rows of a step, one a car. */
export type Pay = (rows: Float64Array) => Float64Array;

interface Paying extends PyProxy {
  rows: PyProxy;
  rewards: PyProxy;
  failure: string;
  remembers: boolean;
  pay(): string;
  printed(): string;
}

export interface Paid {
  pay: Pay;
  printed: () => string;
  /** Whether an earlier step changes what it pays for a later one. */ remembers: boolean;
}

interface Calls extends PyProxy {
  check(question: string): string;
  Paying(question: string): Paying;
  close_doors(): void;
}

/** What a reward function did wrong: its line, the params, what it printed last. */
export class RewardFailure extends Error {}

export class Python {
  private constructor(private readonly calls: Calls) {}

  /** The interpreter and the files of Racecraft that it needs, all from the site. */
  static async load(site: string): Promise<Python> {
    const folder = new URL("python/", site).href;
    const [{ loadPyodide }, files] = await Promise.all([
      import(/* @vite-ignore */ `${folder}pyodide.mjs`) as Promise<typeof import("pyodide")>,
      read(site, "python/racecraft.json").then((answer) => answer.json() as Promise<Record<string, string>>),
    ]);
    const outside = Object.create(null) as object; // what Python's `import js` sees: nothing
    return Python.of(await loadPyodide({ indexURL: folder, jsglobals: outside }), files);
  }

  /** `files`: Python by path. */
  static of(python: PyodideAPI, files: Record<string, string>): Python {
    for (const [path, text] of Object.entries(files)) {
      const full = `/lib/racecraft/${path}`;
      python.FS.mkdirTree(full.slice(0, full.lastIndexOf("/")));
      python.FS.writeFile(full, text);
    }
    python.runPython('import sys; sys.path.append("/lib/racecraft")');
    const calls = python.pyimport("racecraft.site.calls") as unknown as Calls;
    calls.close_doors();
    return new Python(calls);
  }

  /** Its mistakes, and what it pays in situations on a track, which may be among objects. */
  check(source: string, { waypoints, situations }: Pick<TrackFile, "waypoints" | "situations">): RewardVerdict {
    return JSON.parse(this.calls.check(JSON.stringify({ source, waypoints, situations }))) as RewardVerdict;
  }

  /** The function for a training; a RewardFailure where it cannot be loaded. */
  open(source: string, { waypoints }: TrackFile, numCars: number, numColumns: number, seed: number): Paid {
    const paying = this.calls.Paying(JSON.stringify({ source, waypoints, numCars, numColumns, seed }));
    if (paying.failure) throw new RewardFailure(paying.failure);
    const [rows, rewards] = [paying.rows, paying.rewards];
    const over = <T>(array: PyProxy, use: (data: Float64Array) => T): T => {
      const buffer = (array as PyProxy & { getBuffer(type: "f64"): PyBuffer }).getBuffer("f64");
      try {
        return use(buffer.data as Float64Array);
      } finally {
        buffer.release();
      }
    };
    return {
      printed: () => paying.printed(),
      remembers: paying.remembers,
      pay: (seen) => {
        over(rows, (data) => data.set(seen));
        const failure = paying.pay();
        if (failure) throw new RewardFailure(failure);
        return over(rewards, (data) => data.slice());
      },
    };
  }
}
