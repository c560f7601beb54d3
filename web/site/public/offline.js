// Keeps the site in the browser, so that it opens without a network after the first visit. files.js, which `make site`
// writes, says what there is (FILES) and changes with every build (VERSION).
self.importScripts("files.js");

const { FILES, VERSION } = self;

// Whatever the host says of its files' age, the browser asks whether each is still the newest: a kept page whose parts are
// another version's would never open again. Until no tab shows the version before, this one waits, as parts of that are
// loaded when they are needed, and the host has them no more.
self.addEventListener("install", (event) => {
  const newest = ["./", ...FILES].map((file) => new Request(file, { cache: "no-cache" }));
  event.waitUntil(caches.open(VERSION).then((cache) => cache.addAll(newest)));
});

// A tab that has just been opened asks whether it is the only one, so that this version takes over.
self.addEventListener("message", (event) => {
  const ours = ({ url }) => url.startsWith(self.registration.scope);
  const answer = async () => {
    const tabs = await self.clients.matchAll({ type: "window", includeUncontrolled: true });
    const isAlone = tabs.filter(ours).length < 2;
    event.ports[0].postMessage(isAlone);
    if (isAlone) await self.skipWaiting();
  };
  event.waitUntil(answer());
});

self.addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith("racecraft-") && name !== VERSION);
  const forget = caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name))));
  event.waitUntil(forget.then(() => self.clients.claim())); // what the first visit's tab still needs is kept, too
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
