// Keeps the page's own files in the browser, so that it opens without a network after the first visit.
//
// The program's files carry a digest in their names and never change. The others are asked for first, and taken from what was kept
// where no server answers in time. Each version is kept as a whole when it is installed, and nothing is added to it later. It takes
// over once no page of the version before is open, whose files are then deleted. No other address is touched.

const OWN = `typodont ${registration.scope} `;
const CACHE = OWN + "DIGEST";
const PROGRAM = ["typodont-web.js", "typodont-web_bg.wasm"];
const OTHERS = ["./", "start.js", "kept.js", "hid.js", "worker.js", "style.css", "icon.png", "page.webmanifest"];

/** Time for which a server is waited for where a file is kept, ms. */
const PATIENCE = 5000;

const pathOf = (name) => new URL(name, registration.scope).pathname;

addEventListener("install", (event) => {
  const named = (names, cache) => names.map((name) => new Request(name, { cache, redirect: "error" }));
  const files = [...named(PROGRAM, "default"), ...named(OTHERS, "no-cache")];
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(files)));
});

addEventListener("activate", (event) => {
  const isOlder = (name) => name.startsWith(OWN) && name !== CACHE;
  const cleared = caches.keys().then((names) => Promise.all(names.filter(isOlder).map((name) => caches.delete(name))));
  event.waitUntil(cleared.then(() => clients.claim()));
});

addEventListener("fetch", (event) => {
  const { request } = event;
  const { origin, pathname } = new URL(request.url);
  if (origin !== location.origin) return;
  // The page's address may end with the folder or with the file, and have parameters.
  const path = pathname === pathOf("index.html") ? pathOf("./") : pathname;
  const name = [...PROGRAM, ...OTHERS].find((name) => pathOf(name) === path);
  if (name && request.method === "GET") event.respondWith(answer(request, name));
});

async function answer(request, name) {
  const kept = await caches.match(pathOf(name), { cacheName: CACHE, ignoreVary: true }).catch(() => undefined);
  if (!kept) return fetch(request);
  if (PROGRAM.includes(name)) return kept;
  const late = new Promise((resolve) => setTimeout(resolve, PATIENCE));
  const fresh = await Promise.race([fetch(request).catch(() => undefined), late]);
  // A network that one must sign in to answers everything with its own page; only the user's own visit may lead there.
  const isGood = request.mode === "navigate" ? fresh?.status < 500 : fresh?.ok && !fresh.redirected;
  return isGood ? fresh : kept;
}
