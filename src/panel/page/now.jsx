import { printerName, ready, status } from "./state.js";
import { texts } from "./texts.js";

/** The value in force, and the printer that has it. */
export function Now() {
  if (!status.value) return <section class="now" />;
  const { in_force, printer } = status.value;
  return (
    <section class="now">
      <h1>
        {texts.inForce} <span class="where">{texts.onPrinter(printerName.value)}</span>
      </h1>
      <p id="in-force" class="value">
        {in_force || texts.notKnown}
      </p>
      {!ready.value && <p class="warning">{texts.printerNotReady(printer.readiness, printer.message)}</p>}
    </section>
  );
}
