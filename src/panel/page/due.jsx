import { signal } from "@preact/signals";
import { change, choosing, photo } from "./photo.js";
import { busy, followStored, link } from "./state.js";
import { texts } from "./texts.js";

const MOST = 3;

/** What is to be measured again: {instrument, subject, reasons}. */
const due = signal([]);
followStored("due", () => ({}), (answer) => (due.value = answer?.due ?? []));

/** A line for each; a touch leads to the photo. */
export function Due() {
  if (busy.value || photo.value || due.value.length === 0) return null;
  return (
    <div id="due">
      {due.value.slice(0, MOST).map((one) => (
        <Line key={JSON.stringify([one.instrument, one.subject])} one={one} />
      ))}
    </div>
  );
}

function Line({ one: { instrument, subject, reasons } }) {
  const byPhoto = instrument === "pressure_advance";
  const what = [!byPhoto && texts.instrument(instrument), subject?.filament, subject?.nozzle && texts.nozzle(subject.nozzle)];
  const words = texts.due(what.filter(Boolean).join(", ") || texts.instrument(instrument), reasons.join("; "));
  if (!byPhoto) return <p class="quiet">{words}</p>;
  const choose = () => {
    change({ gcode: null, filament: subject?.filament ?? "" });
    choosing.value = true;
  };
  return (
    <button class="plain quiet" disabled={link.value !== "up"} onClick={choose}>
      {words}
    </button>
  );
}
