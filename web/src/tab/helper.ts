/** A thread that helps a core with its loops until it is ended: see team.ts. */
import { CoreModule } from "./module";

export interface Help {
  module: WebAssembly.Module;
  memory: WebAssembly.Memory; // shared
  stack: number; // its upper end
  variables: number; // where the thread's own ones are
}

onmessage = async ({ data: { module, memory, stack, variables } }: MessageEvent<Help>) => {
  try {
    const core = await CoreModule.join(module, memory, stack);
    core.call("__wasm_init_tls", variables);
    postMessage(""); // is there; what comes instead of it says what went wrong
    core.call("help"); // never returns
  } catch (error) {
    postMessage(String(error));
  }
};
