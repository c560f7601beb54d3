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

self.addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || !request.url.startsWith(self.registration.scope)) return;
  const where = { cacheName: VERSION, ignoreSearch: true }; // what the documentation is asked for stands behind a "?"
  event.respondWith(caches.match(request, where).then((found) => found ?? fetch(request)));
});
