/** What stands behind # in an address, which browsers do not send; nothing where it cannot be read. */
export function fragmentOf(hash: string): string {
  try {
    return decodeURIComponent(hash.slice(1));
  } catch {
    return "";
  }
}
