/*! Includes Preact (MIT, © 2015-present Jason Miller) and Preact Signals (MIT, © 2022-present Preact Team). */
import { render } from "preact";
import { startTitle } from "./alert.js";
import { App } from "./app.jsx";
import { photo } from "./photo.js";
import { busy, embedded, printerName, run, start, status, theme } from "./state.js";
import { texts } from "./texts.js";

function title() {
  const where = printerName.value ? ` – ${printerName.value}` : "";
  if (busy.value) {
    const { phase, progress } = run.value;
    return `${texts.phase(phase)}${progress == null ? "" : ` ${texts.percent(progress)}`}${where}`;
  }
  if (photo.value?.step === "sending") return texts.sending;
  if (photo.value?.step === "measuring") return texts.measuring;
  return `${status.value?.proposal ? texts.waits : texts.name}${where}`;
}

if (theme === "dark" || theme === "light") document.documentElement.dataset.theme = theme;
if (embedded) document.documentElement.dataset.embed = "";
startTitle(title);
start();
render(<App />, document.getElementById("panel"));
