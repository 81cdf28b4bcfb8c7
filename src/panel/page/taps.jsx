import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { useNext } from "./next.js";
import { HEIGHT_PX, Plot, rangeOf } from "./plot.jsx";
import { Points } from "./points.jsx";
import { Row } from "./row.jsx";
import { ask, followStored, reportError } from "./state.js";
import { texts } from "./texts.js";
import { dayOf } from "./time.js";
import { Verdict } from "./verdict.jsx";
import { Words } from "./words.jsx";

const LAST = 20;
const PAUSE_MS = 2000;

const NONE = { taps: [], watching: false };
const known = signal(NONE); // the taps, newest first
const looks = signal(1); // each asks again
followStored("taps", () => looks.value && { last: LAST }, (answer) => (known.value = answer ?? NONE));

/** The printer's taps by its load cell, as they come. */
export function Taps() {
  const [open, setOpen] = useState(false);
  useNext(open && known.value, PAUSE_MS, () => looks.value++);
  const { taps, watching } = known.value;
  if (!watching && taps.length === 0) return null;
  return (
    <details id="taps" class="card" onToggle={({ target }) => setOpen(target.open)}>
      <summary>{texts.taps}</summary>
      {open && (
        <div class="fold">
          {!watching && <p class="quiet">{texts.notWatching}</p>}
          {taps.length === 0 ? <p class="quiet">{texts.noTaps}</p> : <List taps={taps} />}
        </div>
      )}
    </details>
  );
}

function List({ taps }) {
  const [chosen, setChosen] = useState("");
  const points = taps
    .filter((one) => one.contact_z_mm != null)
    .map((one) => ({ id: one.tap, at: Date.parse(one.utc), value: one.contact_z_mm, interval: one.interval95_mm }));
  return (
    <>
      {taps[0].verdict === "good" ? <Words words={taps[0].words} /> : <Outcome one={taps[0]} />}
      <Points name={texts.contactHeight} points={points} unit="mm" chosen={chosen} choose={setChosen} />
      <table class="rows">
        <tbody>
          {taps.map((one) => (
            <Row
              key={one.tap}
              open={one.tap === chosen}
              toggle={() => setChosen(one.tap === chosen ? "" : one.tap)}
              cells={[dayOf(one.utc), <Outcome key="outcome" one={one} />]}
            >
              <Tap one={one} />
            </Row>
          ))}
        </tbody>
      </table>
    </>
  );
}

function Outcome({ one: { verdict, words, reason } }) {
  return (
    <>
      <Verdict verdict={verdict} /> {verdict === "good" ? words : reason}
    </>
  );
}

function Tap({ one }) {
  const [curve, setCurve] = useState(null);
  useEffect(() => {
    ask("tap", { tap: one.tap }).then((answer) => setCurve(answer.curve), reportError);
  }, [one.tap]);
  const { x_mm, y_mm, firmware_z_mm } = one;
  const facts = [x_mm != null && texts.place(x_mm, y_mm), firmware_z_mm != null && texts.firmwareZ(firmware_z_mm)];
  return (
    <div class="result">
      <p class="quiet">{facts.filter(Boolean).join(", ")}</p>
      {curve && <Curve curve={curve} one={one} />}
    </div>
  );
}

/** The force against the nozzle's height: pressed to the left. */
function Curve({ curve: { z_mm, force_g, contact_force_g }, one: { contact_z_mm, interval95_mm } }) {
  if (z_mm.length < 2) return null;
  const forces = rangeOf(force_g);
  return (
    <Plot name={texts.forceCurve} x={rangeOf(z_mm)} y={forces} unit={texts.force} xName={texts.height}>
      {(across, down) => (
        <>
          {contact_z_mm != null && (
            <rect
              class="range"
              x={`${across(interval95_mm[0])}%`}
              width={`${across(interval95_mm[1]) - across(interval95_mm[0])}%`}
              y={down(forces[1])}
              height={down(forces[0]) - down(forces[1])}
            />
          )}
          <svg viewBox={`0 0 100 ${HEIGHT_PX}`} preserveAspectRatio="none" width="100%" height={HEIGHT_PX}>
            <polyline points={z_mm.map((z, i) => `${across(z)},${down(force_g[i])}`).join(" ")} />
          </svg>
          {contact_z_mm != null && contact_force_g != null && (
            <g class="point filled">
              <circle cx={`${across(contact_z_mm)}%`} cy={down(contact_force_g)} r="5" />
              <text x={`${across(contact_z_mm)}%`} dx="10" y={down(contact_force_g) - 10}>
                {texts.contact}
              </text>
            </g>
          )}
        </>
      )}
    </Plot>
  );
}
