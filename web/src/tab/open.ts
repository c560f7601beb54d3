import workerAddress from "./worker?worker&url";

/** A worker under the page's own policy, which says what it may reach: one that is loaded by its address has none. */
export function openWorker(): Worker {
  const text = `import ${JSON.stringify(new URL(workerAddress, document.baseURI).href)};`;
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const worker = new Worker(address, { type: "module" });
  URL.revokeObjectURL(address);
  return worker;
}
