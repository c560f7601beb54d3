/** A worker under its opener's own policy, which says what it may reach: one that is loaded by its address has none. */
export function openUnderPolicy(address: string): Worker {
  const text = `import ${JSON.stringify(address)};`;
  const blob = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const worker = new Worker(blob, { type: "module" });
  URL.revokeObjectURL(blob);
  return worker;
}
