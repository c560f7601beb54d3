/** The page that needs no server: one folder for any static host, under any path. */
import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vite";

export default defineConfig({
  root: "site",
  base: "./",
  plugins: [svelte()],
  worker: { format: "es" },
  build: {
    outDir: "../../build/site",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
  },
});
