import { useState } from "preact/hooks";
import { Confirm } from "./confirm.jsx";
import { results } from "./history.js";
import { Live } from "./live.jsx";
import { photo } from "./photo.js";
import { Pictures, Report } from "./pictures.jsx";
import { act, busy, canAsk, canStart, endOf, link, printerName, run, status } from "./state.js";
import { texts } from "./texts.js";
import { Words } from "./words.jsx";

/** The run at work, the answer that waits, or the end of the last run. */
export function Waiting() {
  if (busy.value) return <Run />;
  return (
    <>
      {status.value?.proposal && <Proposal />}
      {run.value && !photo.value && <LastRun />}
    </>
  );
}

function Run() {
  const [asking, setAsking] = useState(false);
  const { job, phase, message, progress, remaining_s, looks, run: name } = run.value;
  return (
    <section class="card" id="run">
      <h2>{texts.job(job)}</h2>
      <p class="phase">
        <strong>{texts.phase(phase)}</strong>
        {progress != null && ` ${texts.percent(progress)}`}
        {remaining_s != null && <span class="quiet"> {texts.left(remaining_s)}</span>}
      </p>
      <progress aria-label={texts.phase(phase)} max="1" value={progress ?? undefined} />
      <p class="quiet message">{message}</p>
      <p class="buttons">
        <button
          id="stop"
          class="primary"
          disabled={link.value !== "up" || phase === "stopping"}
          onClick={() => act("stop", { run: name }, texts.stopping)}
        >
          {texts.stop}
        </button>
        <button id="emergency" class="small danger" disabled={link.value !== "up"} onClick={() => setAsking(true)}>
          {texts.emergencyStop}
        </button>
      </p>
      {looks && <Live key={name} run={name} />}
      <Confirm
        open={asking}
        close={() => setAsking(false)}
        title={texts.emergencyQuestion}
        detail={texts.emergencyDetail}
        yes={texts.emergencyYes}
        act={() => act("emergency_stop", {}, texts.emergencyDone)}
        disabled={link.value !== "up"}
        danger
      />
    </section>
  );
}

function Proposal() {
  const { answer, arguments: given, run: name } = status.value.proposal;
  const measured = results.value.find((one) => one.run === name);
  return (
    <section class="card" id="proposal">
      <h2>{given?.filament ? texts.waitsFor(given.filament) : texts.waits}</h2>
      <Words words={answer} />
      <p class="buttons">
        <button
          id="use-proposal"
          class="primary"
          disabled={!canStart.value}
          onClick={() => act("start", { job: "apply", arguments: { run: name } })}
        >
          {texts.use}
        </button>
        <button id="drop" disabled={!canAsk.value} onClick={() => act("dismiss", {}, texts.dropped)}>
          {texts.drop}
        </button>
      </p>
      {measured && (
        <>
          <Pictures run={name} pictures={measured.pictures} instrument={measured.instrument} />
          <Report run={name} report={measured.report} />
        </>
      )}
    </section>
  );
}

const LONG = 200; // characters of a message that are shown unfolded

function LastRun() {
  const { job, end, message, folder } = run.value;
  const done = end === "done";
  const set = results.value.find((one) => one.folder === folder);
  const kept = done && job === "apply" && set?.instrument === "pressure_advance" && texts.used(printerName.value, texts.keptBy);
  const next = done && (texts.next(job) || kept);
  const folded = !next && !done && message.length > LONG;
  return (
    <div id="last-run" class={next ? "" : "quiet small"}>
      <span aria-hidden="true">{done ? "✓ " : "! "}</span>
      {next || (folded ? texts.lastRun(texts.job(job), texts.end(end)) : endOf(run.value))}
      {folded && (
        <details>
          <summary>{texts.why}</summary>
          {message}
        </details>
      )}
    </div>
  );
}
