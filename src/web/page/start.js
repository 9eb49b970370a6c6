// Loads the program. Whatever prevents that is shown in the page's status.
import init from "./typodont-web.js";

const language = navigator.language.startsWith("tr") ? "tr" : "en";
document.documentElement.lang = language;
for (const text of document.querySelectorAll("#status [lang]")) {
  text.hidden = text.lang !== language;
}

init({ module_or_path: new URL("typodont-web_bg.wasm", import.meta.url) }).catch((error) => {
  document.getElementById("status")?.classList.add("failed");
  document.getElementById("reason").textContent = String(error);
});
