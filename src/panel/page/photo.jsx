import { useRef, useState } from "preact/hooks";
import { Dialog } from "./confirm.jsx";
import { change, choice, choosing, forget, measurePhoto, photo } from "./photo.js";
import { busy, embedded, link, status } from "./state.js";
import { texts } from "./texts.js";
import { PHOTO_TYPES } from "./upload.js";

/** The button, the choice before a photo, and the photo's way until it is measured. */
export function Photo() {
  const step = photo.value?.step;
  return (
    <>
      {!step && <ChooseButton words={texts.photograph} plain={busy.value || Boolean(status.value?.proposal)} />}
      {!step && !embedded && <p class="quiet small">{texts.intro}</p>}
      {step === "sending" && <Sending />}
      {step === "measuring" && (
        <section class="card" id="measuring">
          <h2>{texts.measuring}</h2>
          <progress aria-label={texts.measuring} />
        </section>
      )}
      {step === "failed" && <Failed />}
      <Choice />
    </>
  );
}

export function ChooseButton({ words, plain }) {
  return (
    <p class="buttons">
      <button
        id="photograph"
        class={plain ? "large" : "primary large"}
        disabled={link.value !== "up"}
        onClick={() => (choosing.value = true)}
      >
        {words}
      </button>
    </p>
  );
}

function Choice() {
  const camera = useRef();
  const { pattern } = choice.value;
  const close = () => (choosing.value = false);
  const picked = ({ target }) => {
    const file = target.files[0];
    if (!file) return;
    close();
    measurePhoto(file);
  };
  return (
    <Dialog open={choosing.value} close={close} title={texts.whatPrinted} id="choice">
      <div class="choices">
        {texts.patterns.map(([code, name]) => (
          <label key={code}>
            <input
              type="radio"
              name="pattern"
              value={code}
              checked={code === pattern}
              onChange={() => change({ pattern: code })}
            />
            {name}
          </label>
        ))}
      </div>
      <More />
      <p class="quiet">{texts.photoAdvice}</p>
      <input ref={camera} id="camera" type="file" hidden accept={PHOTO_TYPES} onChange={picked} />
      <p class="buttons">
        <button class="primary focus" onClick={() => camera.current.click()}>
          {texts.choosePhoto}
        </button>
        <button onClick={close}>{texts.cancel}</button>
      </p>
    </Dialog>
  );
}

function More() {
  const { gcode, filament } = choice.value;
  const [open] = useState(Boolean(gcode || filament)); // at first; then as the owner wants it
  return (
    <details open={open}>
      <summary>{texts.more}</summary>
      {gcode ? (
        <p class="buttons">
          {gcode.name}
          <button class="small" onClick={() => change({ gcode: null })}>
            {texts.remove}
          </button>
        </p>
      ) : (
        <label>
          {texts.gcode}
          <input
            id="gcode"
            type="file"
            accept=".gcode,.3mf"
            onChange={({ target }) => change({ gcode: target.files[0] ?? null })}
          />
        </label>
      )}
      <label>
        {texts.filament}
        <input
          id="filament"
          type="text"
          maxlength="100"
          value={filament}
          onInput={({ target }) => change({ filament: target.value })}
        />
      </label>
    </details>
  );
}

function Sending() {
  const { sent, total } = photo.value;
  return (
    <section class="card" id="sending">
      <h2>{texts.sending}</h2>
      <progress aria-label={texts.sending} max={total} value={sent} />
      <p class="quiet">{texts.megabytes(sent, total)}</p>
      <p class="buttons">
        <button onClick={forget}>{texts.cancel}</button>
      </p>
    </section>
  );
}

function Failed() {
  const { error, file, arrived } = photo.value;
  return (
    <section class="card" id="failed">
      <h2>
        <span aria-hidden="true">! </span>
        {error}
      </h2>
      <p class="buttons">
        {!arrived && (
          <button class="primary" disabled={link.value !== "up"} onClick={() => measurePhoto(file)}>
            {texts.sendAgain}
          </button>
        )}
        <button class={arrived ? "primary" : ""} disabled={link.value !== "up"} onClick={() => (choosing.value = true)}>
          {texts.photographAnother}
        </button>
      </p>
    </section>
  );
}
