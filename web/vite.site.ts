/** The pages that need no server, where cars learn and the lessons: one folder for any static host, under any path. */
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
    rolldownOptions: { input: ["site/index.html", "site/lessons.html"] },
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
  },
});
