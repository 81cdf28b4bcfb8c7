import { useEffect, useState } from "preact/hooks";
import { Confirm } from "./confirm.jsx";
import { act, ask, blockerOf, busy, canStart, ready, status } from "./state.js";
import { texts } from "./texts.js";

const OFFER_PAUSE_MS = 400; // while the owner writes

/** What the printer can do: it heats and moves, so each job asks first. */
export function Jobs() {
  if (!status.value) return null;
  return (
    <section id="jobs">
      <Job
        job="photo_pattern"
        words={texts.printPattern}
        title={texts.bedQuestion}
        detail={texts.printDetail}
        yes={texts.printYes}
        fields={["material", "filament"]}
      />
      <Job
        job="pressure_advance"
        words={texts.scan}
        title={texts.bedQuestion}
        detail={texts.scanDetail}
        yes={texts.scanYes}
        fields={["material", "filament"]}
        strict
      />
    </section>
  );
}

/** Returns why a job cannot start, unless that is to be seen elsewhere: the printer is not ready, or at work. */
export const reasonAgainst = (job) => ready.value && !busy.value && blockerOf(job);

export async function startJob(job, given) {
  if (await act("start", { job, arguments: given })) scrollTo(0, 0); // to the run
}

// A missing material blocks a print until the dialog names it, so a blocker alone keeps nobody from asking.
export function Job({ job, words, detail, strict, ...question }) {
  const [asking, setAsking] = useState(false);
  const reason = reasonAgainst(job);
  if (strict && reason) return <p class="quiet small">{texts.cannot(words, reason)}</p>;
  return (
    <div class="job">
      <button id={job} disabled={!canStart.value} onClick={() => setAsking(true)}>
        {words}
      </button>
      <p class="quiet small">{reason ? texts.cannot(words, reason) : detail}</p>
      <Start open={asking} close={() => setAsking(false)} job={job} detail={detail} {...question} />
    </div>
  );
}

/** The question before a job. The service words it, where it knows more: which paper belongs where. */
function Start({ open, close, job, title, detail, yes, fields }) {
  const [written, setWritten] = useState({});
  const [offer, setOffer] = useState("");
  const given = Object.fromEntries(
    Object.entries(written)
      .map(([name, text]) => [name, text.trim()])
      .filter(([, text]) => text),
  );
  const offered = JSON.stringify(given);
  useEffect(() => {
    if (!open) return;
    let newest = true;
    const take = (question) => newest && setOffer(question);
    const asks = () =>
      ask("offer", { job, arguments: given }).then(
        ({ question }) => take(question),
        () => take(""),
      );
    const timer = setTimeout(asks, OFFER_PAUSE_MS);
    return () => {
      newest = false;
      clearTimeout(timer);
    };
  }, [open, offered]);
  const write = ({ target }) => setWritten({ ...written, [target.name]: target.value });
  return (
    <Confirm
      open={open}
      close={close}
      title={title}
      detail={offer || detail}
      yes={yes}
      act={() => startJob(job, given)}
      disabled={!canStart.value}
    >
      {fields.map((name) => (
        <label key={name}>
          {texts.fields[name]}
          {name === "material" ? (
            <select name={name} value={written[name] ?? ""} onChange={write}>
              <option value="">{texts.materialOfSettings}</option>
              {texts.materials.map((material) => (
                <option key={material} value={material}>
                  {material.toUpperCase()}
                </option>
              ))}
            </select>
          ) : (
            <input type="text" name={name} maxlength="100" value={written[name] ?? ""} onInput={write} />
          )}
        </label>
      ))}
    </Confirm>
  );
}
