/** The words of a login card: an address to open, and the secret as it is printed and typed. */

/** As people copy it: in fours. */
export const inFours = (secret: string): string => secret.match(/.{1,4}/g)?.join("-") ?? "";

/** Of what somebody typed: all that stands under the code, its second line alone, or a whole link. */
export const secretOf = (typed: string): string =>
  typed
    .split(/#|\/card/)
    .at(-1)!
    .replace(/\s/g, "");
