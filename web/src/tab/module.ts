// One instance of the core's WebAssembly (native/wasm/): its memory, its functions by name, and its refusals.

/** What the core turned down, in its own sentence. */
export class Refusal extends Error {}

/** Address of something in the module's memory. */
export type Address = number;

type Numbers = Float64Array | Float32Array | Int32Array | Uint8Array | BigUint64Array | BigInt64Array;
type Exports = Record<string, ((...args: number[]) => number) & WebAssembly.Global<"i32">>;
type Kind<T extends Numbers> = new (buffer: ArrayBufferLike, at: number, length: number) => T;

export class CoreModule {
  private constructor(
    private readonly memory: WebAssembly.Memory,
    private readonly exports: Exports,
    private readonly stack: WebAssembly.Global<"i32">,
  ) {}

  /** With memory that other threads are to share where the build asks for one. */
  static async load(code: BufferSource | WebAssembly.Module, shared?: WebAssembly.Memory): Promise<CoreModule> {
    const module = code instanceof WebAssembly.Module ? code : await WebAssembly.compile(code);
    const core = await CoreModule.instantiate(module, shared);
    core.call("_initialize");
    return core;
  }

  /** One more thread in a memory that is in use, on a stack of its own that ends there. */
  static async join(module: WebAssembly.Module, shared: WebAssembly.Memory, stack: Address): Promise<CoreModule> {
    const core = await CoreModule.instantiate(module, shared);
    core.stack.value = stack;
    return core;
  }

  private static async instantiate(module: WebAssembly.Module, shared?: WebAssembly.Memory): Promise<CoreModule> {
    const imports: WebAssembly.Imports = {};
    for (const { module: from, name } of WebAssembly.Module.imports(module)) {
      // The C library's ways out, of which the core takes none.
      (imports[from] ??= {})[name] = () => {
        throw new Error(`The core called ${from}.${name}.`);
      };
    }
    (imports["racecraft"] ??= {})["refuse"] = (at: Address, size: number) => {
      throw new Refusal(new TextDecoder().decode(new Uint8Array(memory.buffer, at, size).slice()));
    };
    if (shared) (imports["env"] ??= {})["memory"] = shared;
    const { exports } = await WebAssembly.instantiate(module, imports);
    const memory = shared ?? (exports["memory"] as WebAssembly.Memory);
    return new CoreModule(memory, exports as Exports, exports["__stack_pointer"] as WebAssembly.Global<"i32">);
  }

  /** Calls one of native/wasm/interface.cpp's functions. */
  call(name: string, ...args: number[]): number {
    const run = this.exports[name];
    if (!run) throw new Error(`The core has no function ${name}.`);
    const before = this.stack.value;
    try {
      return run(...args);
    } catch (error) {
      this.stack.value = before; // an exception leaves the core's frames where they are
      throw error;
    }
  }

  /** A number that the linker wrote down. */
  constant(name: string): number {
    return this.exports[name]!.value;
  }

  /** Calls with arrays, which are copied in and gone afterwards. */
  with<T>(arrays: Numbers[], use: (...at: Address[]) => T): T {
    const at = arrays.map((array) => this.place(array));
    try {
      return use(...at);
    } finally {
      for (const address of at) this.call("release", address);
    }
  }

  /** Memory of the core's own, to be given back with `release`. */
  allocate(bytes: number): Address {
    const at = this.call("allocate", Math.max(bytes, 8));
    if (at === 0) throw new Error(`The tab has no memory left for ${bytes} bytes.`);
    return at;
  }

  /** An array of the core's as it lies there: good until the core's memory grows, so not to be kept. */
  view<T extends Numbers>(kind: Kind<T>, at: Address, length: number): T {
    return new kind(this.memory.buffer, at, length);
  }

  /** Names of settings and columns, see names_of() in the interface. */
  names(list: number): string[] {
    const bytes = new Uint8Array(this.memory.buffer, this.call("names_of", list));
    return new TextDecoder()
      .decode(bytes.slice(0, bytes.indexOf(0)))
      .trim()
      .split(" ");
  }

  private place(array: Numbers): Address {
    const at = this.allocate(array.byteLength);
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    new Uint8Array(this.memory.buffer, at, array.byteLength).set(bytes);
    return at;
  }
}
