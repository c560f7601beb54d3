// One core, several threads: the caller and its helpers, workers with an instance each over one shared memory, which run
// the loops of native/wasm/shared_threads.cpp. The bits are those of one thread.
import type { Help } from "./helper";
import { CoreModule } from "./module";

/** What has a worker's messages, in a browser or in Node. */
export type Helper = Pick<Worker, "postMessage" | "terminate" | "onmessage" | "onerror">;

const MEMORY = { initial: 256, maximum: 16_384, shared: true }; // pages of 64 KiB, within what native/wasm/Makefile says
const STACK = 2 ** 20; // bytes, as the caller has
const MOST = 8; // the learner gains nothing from more

/** How many threads a core may have here: more than one where the page is cross-origin isolated. */
export function availableThreads(): number {
  return globalThis.crossOriginIsolated ? Math.max(1, Math.min(navigator.hardwareConcurrency, MOST)) : 1;
}

/** A core of so many threads; an Error, and no helper is left, where memory or a worker is refused. */
export async function loadTeam(code: BufferSource, threads: number, open: () => Helper): Promise<CoreModule> {
  const module = await WebAssembly.compile(code);
  const memory = new WebAssembly.Memory(MEMORY);
  const core = await CoreModule.load(module, memory);
  const helpers = Array.from({ length: threads - 1 }, open);
  try {
    await Promise.all(helpers.map((helper) => join(helper, core, { module, memory })));
  } catch (error) {
    for (const helper of helpers) helper.terminate();
    throw error;
  }
  core.call("expect_helpers", helpers.length);
  return core;
}

/** Give a helper a stack and variables of its own; from then on it waits for loops. */
function join(helper: Helper, core: CoreModule, shared: Pick<Help, "module" | "memory">): Promise<void> {
  const stack = core.allocate(STACK) + STACK; // grows downwards
  const variables = core.allocate(core.constant("__tls_size"));
  return new Promise((joined, failed) => {
    helper.onmessage = ({ data }: MessageEvent<string>) => (data ? failed(new Error(data)) : joined());
    helper.onerror = ({ message }) => failed(new Error(message || "A helper did not start."));
    helper.postMessage({ ...shared, stack, variables } satisfies Help);
  });
}
