import { effect, signal } from "@preact/signals";
import { useState } from "preact/hooks";
import { Confirm } from "./confirm.jsx";
import { ask, busy, canStart, embedded, printer, printerName, ready, reportError, say, status } from "./state.js";
import { texts } from "./texts.js";

const RESTART_PATIENCE_MS = 300000; // Klipper starts, and once more where the change has to be taken back

/** What the printer's configuration lacks: {has_macros, missing, changes, can_undo}. */
const setup = signal(null);
let asked;

async function change(method, words, patienceMs) {
  const of = printer.peek();
  if (words) say(words);
  try {
    const answer = await ask(method, {}, patienceMs);
    if (of === printer.peek()) setup.value = answer;
    if (words) say(texts.setUpDone);
  } catch (error) {
    reportError(error);
  }
}

// Once for each printer, as soon as it is ready.
effect(() => {
  const wanted = !embedded && status.value && ready.value && !busy.value ? printerName.value : "";
  if (!wanted || wanted === asked) return;
  asked = wanted;
  setup.value = null;
  change("setup");
});

/** Offers the printer's set-up, and its way back. */
export function Setup() {
  const [asking, setAsking] = useState("");
  const state = setup.value;
  if (!state || (state.has_macros && !state.can_undo && state.missing.length === 0)) return null;
  const close = () => setAsking("");
  return (
    <section id="setup">
      <h2>{texts.setup}</h2>
      {!state.has_macros && (
        <>
          <p>{texts.setupWhy}</p>
          <ul>
            {state.changes.map((one) => (
              <li key={one.file}>
                <strong>{one.file}</strong>: {one.change}
              </li>
            ))}
          </ul>
          <button id="set-up" disabled={!canStart.value} onClick={() => setAsking("set_up")}>
            {texts.setUp}
          </button>
        </>
      )}
      {state.missing.length > 0 && (
        <details>
          <summary>{texts.missing(state.missing.length)}</summary>
          <ul>
            {state.missing.map((one) => (
              <li key={one.section}>
                <strong>{one.section}</strong>: {one.purpose}
              </li>
            ))}
          </ul>
        </details>
      )}
      {state.can_undo && (
        <p>
          <button id="undo-set-up" class="small" disabled={!canStart.value} onClick={() => setAsking("undo_set_up")}>
            {texts.undoSetUp}
          </button>
        </p>
      )}
      <Confirm
        open={asking !== ""}
        close={close}
        title={asking === "set_up" ? texts.setUp : texts.undoSetUp}
        detail={asking === "set_up" ? texts.setUpDetail : texts.undoDetail}
        yes={texts.restartYes}
        act={() => change(asking, texts.restarting, RESTART_PATIENCE_MS)}
        disabled={!canStart.value}
      />
    </section>
  );
}
