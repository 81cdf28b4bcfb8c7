import { choosePrinter, printer, printerName, printers, ready, status } from "./state.js";
import { texts } from "./texts.js";

/** The value in force, and the printer that has it. */
export function Now() {
  return (
    <section class="now">
      <h1>
        {texts.inForce}{" "}
        {printers.value.length > 1 ? <Printers /> : printerName.value}
      </h1>
      {status.value && <InForce />}
    </section>
  );
}

function InForce() {
  const { in_force, printer } = status.value;
  return (
    <>
      <p id="in-force" class="value">
        {in_force || texts.notKnown}
      </p>
      {!ready.value && <p class="warning">{texts.printerNotReady(printer.readiness, printer.message)}</p>}
    </>
  );
}

function Printers() {
  const choose = ({ target }) => choosePrinter(Number(target.value));
  return (
    <select id="printer" aria-label={texts.printer} value={printer.value} onChange={choose}>
      {printers.value.map((one) => (
        <option key={one.printer} value={one.printer}>
          {one.name}
        </option>
      ))}
    </select>
  );
}
