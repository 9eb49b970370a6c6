// Runs a lesson beside the page, so that its ticks do not wait for pictures (`page_worker.rs` in the crate `app`).
//
// The page's first message is the program as it has compiled it; the program answers when it is ready, and takes all further
// messages. The page keeps the recording, so that it can delete it when the bundle is saved.
import init from "./typodont-web.js";
import "./hid.js";

const keep = (name) => (...given) => postMessage({ keep: name, given });
globalThis.typodontKept = { begin: keep("begin"), keep: keep("keep"), replace: keep("replace") };

// A failure of the program is to reach the page as one of the worker.
// A lesson that is left before the program is ready says so by an empty message.
onmessage = ({ data }) => data && init({ module_or_path: data }).catch((error) => setTimeout(() => { throw error; }));
