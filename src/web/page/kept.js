// Keeps the recordings of sessions whose bundles are not saved yet, so that a page that is closed, reloaded or crashes loses at most
// the last second. The program calls these functions (`platform/web.rs` in the crate `app`).
//
// A recording is kept as its changes, in order; each replaces everything from its offset on. A lock of the session's name tells
// other pages that it is still running; where a browser has no locks, as by HTTP, the time of its last change does. A session is
// offered by one page at a time, and only at the address at which it was begun, so that nobody finishes another learner's work within a learning platform.

const STORE = "changes";

/** Sessions that are offered at once: their recordings are read as a whole. */
const OFFERED_MAX = 3;

/** Time after which a session that nobody finished is deleted, ms. */
const EXPIRY = 30 * 24 * 3600 * 1000;

/** Time for which a session without a lock counts as running after its last change, ms. */
const RUNNING = 15000;

const lockOf = (session) => `typodont ${session}`;
const keysOf = (session) => IDBKeyRange.bound([session], [session, []]);

/** The page's address, and for whom and with which exercise it was opened. */
const place = (() => {
  const asked = new URLSearchParams(location.search);
  return [location.pathname.replace(/index\.html$/, ""), asked.get("exercise") ?? "", asked.get("participant") ?? ""].join(" ");
})();

let opened;
const open = () => opened ??= new Promise((resolve, reject) => {
  const request = indexedDB.open("typodont", 1);
  request.onupgradeneeded = () => request.result.createObjectStore(STORE, { keyPath: ["session", "number"] });
  request.onsuccess = () => {
    // A browser may close it, as when the user clears the page's data.
    request.result.onclose = () => { opened = undefined; };
    resolve(request.result);
  };
  request.onerror = () => reject(request.error);
}).catch((error) => { opened = undefined; throw error; });

/** Runs a transaction; resolves with the request's result once the transaction is complete. */
const transact = async (mode, work) => {
  const database = await open();
  return new Promise((resolve, reject) => {
    const transaction = database.transaction(STORE, mode);
    const request = work(transaction.objectStore(STORE));
    transaction.oncomplete = () => resolve(request?.result);
    transaction.onabort = () => reject(transaction.error);
  });
};

/** Changes that are not kept yet, in order; those that could not be are tried again with the next. */
let waiting = [];
let writing;
let failure;
let isTold = false;

/** Recordings whose sessions went on as others, to be deleted when those are kept. */
let replaced = [];

const writeAll = async () => {
  while (waiting.length > 0) {
    const changes = waiting;
    waiting = [];
    try {
      await transact("readwrite", (store) => changes.forEach((change) => store.put(change)));
    } catch (error) {
      waiting = [...changes, ...waiting];
      failure ??= String(error);
      return;
    }
  }
  const former = replaced;
  replaced = [];
  for (const session of former) {
    await remove(session).catch(() => {});
    release(session);
  }
};

/** Keeps what is waiting; resolves when it is kept, or could not be. */
const write = () => writing ??= writeAll().finally(() => { writing = undefined; });

/** Ends of the locks that this page holds, by session. */
const releases = new Map();

const release = (session) => {
  releases.get(session)?.();
  releases.delete(session);
};

/** Takes the lock of a session that runs in no page; resolves with false if another page has taken it. */
const take = (session) => new Promise((resolve) => {
  const hold = (lock) => {
    resolve(lock !== null);
    return lock && new Promise((end) => releases.set(session, end));
  };
  navigator.locks.request(lockOf(session), { ifAvailable: true }, hold).catch(() => resolve(false));
});

const remove = (session) => transact("readwrite", (store) => store.delete(keysOf(session)));

globalThis.typodontKept = {
  /** Marks a session as running in this page. */
  begin(session) {
    failure = undefined;
    isTold = false;
    waiting = waiting.filter((change) => change.session !== session);
    const held = new Promise((release) => releases.set(session, release));
    navigator.locks?.request(lockOf(session), () => held).catch(() => {});
  },

  /** Keeps a change of a session's recording. */
  keep(session, number, offset, bytes) {
    waiting.push({ session, number, offset, bytes, place, at: Date.now() });
    write();
  },

  /** Deletes a session's recording. */
  forget(session) {
    waiting = waiting.filter((change) => change.session !== session);
    remove(session).catch(() => {}).then(() => release(session));
  },

  /** Deletes the recording of a session that goes on as another one, once that is kept. */
  replace(former) {
    replaced.push(former);
    write();
  },

  /** The reason why a change could not be kept, once for each session. */
  complaint() {
    if (isTold || failure === undefined) return undefined;
    isTold = true;
    return failure;
  },

  /** The recordings of sessions that were begun at this address and run in no page, as pairs of name and bytes. */
  async read() {
    const locks = await navigator.locks?.query();
    const held = new Set(locks?.held.map((lock) => lock.name));
    const names = new Set((await transact("readonly", (store) => store.getAllKeys())).map(([session]) => session));
    const offered = [];
    for (const session of names) {
      if (held.has(lockOf(session)) || offered.length === OFFERED_MAX) continue;
      const changes = await transact("readonly", (store) => store.getAll(keysOf(session)));
      const age = Date.now() - (changes.at(-1)?.at ?? 0);
      // Nothing can be scored without the beginning.
      if (age > EXPIRY || changes[0]?.number !== 0) {
        await remove(session).catch(() => {});
        continue;
      }
      if (changes[0].place !== place || (!locks && age < RUNNING)) continue;
      // Only one page offers it, so that nobody goes on with it twice.
      if (locks && !await take(session)) continue;
      const gap = changes.findIndex((change, index) => change.number !== index);
      const whole = gap < 0 ? changes : changes.slice(0, gap);
      const recording = new Uint8Array(Math.max(...whole.map(({ offset, bytes }) => offset + bytes.length)));
      for (const { offset, bytes } of whole) recording.set(bytes, offset);
      offered.push([session, recording]);
    }
    return offered;
  },
};
