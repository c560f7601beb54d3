/** Every script and style of the built pages once more as .br, which the server sends to browsers that take them. */
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { brotliCompressSync } from "node:zlib";

const folder = new URL("../src/racecraft/serve/pages/assets/", import.meta.url);
for (const name of readdirSync(folder).filter((one) => /\.(js|css|svg)$/.test(one))) {
  const data = readFileSync(new URL(name, folder));
  writeFileSync(new URL(`${name}.br`, folder), brotliCompressSync(data));
}
