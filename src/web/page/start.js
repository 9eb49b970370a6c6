// Loads the program. Whatever prevents that is shown in the page's status.
import init from "./typodont-web.js";

const asked = new URLSearchParams(location.search).get("language") || navigator.language;
const language = asked.startsWith("tr") ? "tr" : "en";
document.documentElement.lang = language;
for (const text of document.querySelectorAll("main [lang]")) {
  text.hidden = text.lang !== language;
}

// A browser that keeps nothing can still be worked in.
await import("./kept.js").catch(() => {});
await import("./hid.js").catch(() => {});

// Without a graphics processor nothing can be drawn, not even by the program that would say so.
const lost = document.getElementById("lost");
let isLost = false;
const showLoss = () => {
  isLost = true;
  lost.hidden = false;
  lost.querySelector("button:not([hidden])").focus();
};
for (const button of lost.querySelectorAll("button")) button.addEventListener("click", () => location.reload());
document.getElementById("typodont").addEventListener("webglcontextlost", showLoss);
const adapter = globalThis.GPUAdapter?.prototype;
if (adapter) {
  const requestDevice = adapter.requestDevice;
  adapter.requestDevice = async function (...asked) {
    const device = await requestDevice.apply(this, asked);
    device.lost.then(({ reason }) => { if (reason !== "destroyed") showLoss(); });
    return device;
  };
}

init({ module_or_path: new URL("typodont-web_bg.wasm", import.meta.url) }).catch((error) => {
  document.getElementById("status")?.classList.add("failed");
  document.getElementById("reason").textContent = String(error);
});

// The program marks the page while a session or an unsaved bundle would be lost with it.
addEventListener("beforeunload", (event) => {
  if (!isLost && document.documentElement.hasAttribute("data-unsaved")) event.preventDefault();
});

// Without a network, the page opens from what the browser kept. Within a learning platform, the platform decides what is kept.
if (parent === window) {
  navigator.serviceWorker?.register(new URL("offline.js", import.meta.url)).catch(() => {});
}
