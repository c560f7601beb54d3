/** Takes from this worker what leads out of it: somebody else's Python may find its way to JavaScript, whatever it is told
 * of it, and the page's policy says only which sites it reaches, not what this browser keeps for the page. */

const LANGUAGE = `AggregateError Array ArrayBuffer AsyncDisposableStack Atomics BigInt BigInt64Array BigUint64Array Boolean
  DataView Date DisposableStack Error EvalError FinalizationRegistry Float16Array Float32Array Float64Array Function Infinity
  Int16Array Int32Array Int8Array Intl Iterator JSON Map Math NaN Number Object Promise Proxy RangeError ReferenceError
  Reflect RegExp Set SharedArrayBuffer String SuppressedError Symbol SyntaxError TypeError URIError Uint16Array Uint32Array
  Uint8Array Uint8ClampedArray WeakMap WeakRef WeakSet WebAssembly constructor decodeURI decodeURIComponent encodeURI
  encodeURIComponent escape eval globalThis isFinite isNaN parseFloat parseInt undefined unescape`;
/** What cars that learn take beside it: to be asked and to answer, to wait, to tell the time. */
const NEEDED = `addEventListener atob btoa clearInterval clearTimeout console crossOriginIsolated crypto dispatchEvent
  DOMException ErrorEvent Event EventTarget isSecureContext location MessageEvent name onerror onmessage performance
  postMessage queueMicrotask removeEventListener reportError self setInterval setTimeout structuredClone TextDecoder
  TextEncoder URL URLSearchParams`;
const KEPT = new Set(`${LANGUAGE} ${NEEDED}`.split(/\s+/));

/** For good: no storage, no network, no other worker is left to whatever runs here from now on, and nothing gives it back. */
export function leaveAlone(scope: object = globalThis): void {
  for (let part = scope; part !== Object.prototype; part = Object.getPrototypeOf(part) as object)
    for (const name of Object.getOwnPropertyNames(part)) if (!KEPT.has(name)) Reflect.deleteProperty(part, name);
}
