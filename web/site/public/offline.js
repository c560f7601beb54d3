// Keeps the site in the browser, so that it opens without a network after the first visit. files.js, which `make site`
// writes, says what there is (FILES) and changes with every build (VERSION).
self.importScripts("files.js");

const { FILES, VERSION } = self;

self.addEventListener("install", (event) => {
  self.skipWaiting();
  event.waitUntil(caches.open(VERSION).then((cache) => cache.addAll(["./", ...FILES])));
});

self.addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith("racecraft-") && name !== VERSION);
  event.waitUntil(caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))));
});

// Alone in its process the page may have several threads over one memory; many hosts cannot say so themselves.
const ISOLATED = [
  ["Cross-Origin-Opener-Policy", "same-origin"],
  ["Cross-Origin-Embedder-Policy", "require-corp"],
];

function isolated({ body, headers: kept }) {
  const headers = new Headers(kept);
  for (const [name, value] of ISOLATED) headers.set(name, value);
  return new Response(body, { headers });
}

self.addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || !request.url.startsWith(self.registration.scope)) return;
  const where = { cacheName: VERSION, ignoreSearch: true }; // what the documentation is asked for stands behind a "?"
  event.respondWith(caches.match(request, where).then((found) => (found ? isolated(found) : fetch(request))));
});
