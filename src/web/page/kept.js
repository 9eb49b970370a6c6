// Keeps the recordings of sessions whose bundles are not saved yet, so that a page that is closed, reloaded or crashes loses at most
// the last second. The program calls these functions (`platform/web.rs` in the crate `app`).
//
// A recording is kept as its changes, in order; each replaces everything from its offset on. A lock of the session's name tells
// other pages that it is still running.

const STORE = "changes";
const lockOf = (session) => `typodont ${session}`;
const keyRange = (session) => IDBKeyRange.bound([session], [session, []]);

const opened = new Promise((resolve, reject) => {
  const request = indexedDB.open("typodont", 1);
  request.onupgradeneeded = () => request.result.createObjectStore(STORE, { keyPath: ["session", "number"] });
  request.onsuccess = () => resolve(request.result);
  request.onerror = () => reject(request.error);
});
// Read by `complaint`, too.
opened.catch(() => {});

/** The first failure, until it is told. Later ones say nothing new. */
let failure;
let isTold = false;

/** Runs a transaction; resolves with the request's result once the transaction is complete. */
const transact = async (mode, work) => {
  const database = await opened;
  return new Promise((resolve, reject) => {
    const transaction = database.transaction(STORE, mode);
    const request = work(transaction.objectStore(STORE));
    transaction.oncomplete = () => resolve(request.result);
    transaction.onabort = () => reject(transaction.error);
  });
};

const releases = new Map();

globalThis.typodontKept = {
  /** Marks a session as running in this page. */
  begin(session) {
    navigator.locks?.request(lockOf(session), () => new Promise((release) => releases.set(session, release)));
  },

  /** Keeps a change of a session's recording. */
  keep(session, number, offset, bytes) {
    transact("readwrite", (store) => store.put({ session, number, offset, bytes })).catch((error) => { failure ??= String(error); });
  },

  /** Deletes a session's recording. */
  forget(session) {
    releases.get(session)?.();
    releases.delete(session);
    transact("readwrite", (store) => store.delete(keyRange(session))).catch(() => {});
  },

  /** The reason why a change could not be kept, the first time that it is asked for. */
  complaint() {
    if (isTold || failure === undefined) return undefined;
    isTold = true;
    return failure;
  },

  /** The recordings of sessions that run in no page, as pairs of name and bytes, oldest first. */
  async read() {
    const changes = await transact("readonly", (store) => store.getAll());
    const held = new Set((await navigator.locks?.query())?.held.map((lock) => lock.name));
    const sessions = new Map();
    for (const { session, offset, bytes } of changes) {
      if (held.has(lockOf(session))) continue;
      const whole = sessions.get(session) ?? { length: 0, parts: [] };
      sessions.set(session, whole);
      whole.parts.push({ offset, bytes });
      whole.length = Math.max(whole.length, offset + bytes.length);
    }
    return [...sessions].map(([session, { length, parts }]) => {
      const recording = new Uint8Array(length);
      for (const { offset, bytes } of parts) recording.set(bytes, offset);
      return [session, recording];
    });
  },
};
