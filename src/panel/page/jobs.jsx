import { useState } from "preact/hooks";
import { Confirm } from "./confirm.jsx";
import { act, blockerOf, busy, canStart, ready, status } from "./state.js";
import { texts } from "./texts.js";

/** What the printer can do: it heats and moves, so each job asks first. */
export function Jobs() {
  const [asking, setAsking] = useState("");
  if (!status.value) return null;
  const close = () => setAsking("");
  return (
    <section id="jobs">
      <Job job="photo_pattern" words={texts.printPattern} detail={texts.printDetail} start={setAsking} />
      <Job job="pressure_advance" words={texts.scan} detail={texts.scanDetail} start={setAsking} strict />
      <Start
        open={asking === "photo_pattern"}
        close={close}
        job="photo_pattern"
        detail={texts.printDetail}
        yes={texts.printYes}
      />
      <Start
        open={asking === "pressure_advance"}
        close={close}
        job="pressure_advance"
        detail={texts.scanDetail}
        yes={texts.scanYes}
      />
    </section>
  );
}

// A missing material blocks the pattern until the dialog names it, so its blocker alone keeps nobody from asking.
function Job({ job, words, detail, start, strict }) {
  const blocker = blockerOf(job);
  const shown = blocker && ready.value && !busy.value;
  if (strict && shown) return <p class="quiet small">{texts.cannot(words, blocker)}</p>;
  return (
    <div class="job">
      <button id={job} disabled={!canStart.value} onClick={() => start(job)}>
        {words}
      </button>
      <p class="quiet small">{shown ? texts.cannot(words, blocker) : detail}</p>
    </div>
  );
}

function Start({ open, close, job, detail, yes }) {
  const [filament, setFilament] = useState("");
  const [material, setMaterial] = useState("");
  const start = () =>
    act("start", { job, arguments: { ...(filament.trim() && { filament: filament.trim() }), ...(material && { material }) } });
  return (
    <Confirm
      open={open}
      close={close}
      title={texts.printQuestion}
      detail={detail}
      yes={yes}
      act={start}
      disabled={!canStart.value}
    >
      <label>
        {texts.material}
        <select value={material} onChange={({ target }) => setMaterial(target.value)}>
          <option value="">{texts.materialOfSettings}</option>
          {texts.materials.map((name) => (
            <option key={name} value={name}>
              {name.toUpperCase()}
            </option>
          ))}
        </select>
      </label>
      <label>
        {texts.filamentName}
        <input
          type="text"
          maxlength="100"
          value={filament}
          onInput={({ target }) => setFilament(target.value)}
        />
      </label>
    </Confirm>
  );
}
