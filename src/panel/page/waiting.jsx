import { useState } from "preact/hooks";
import { Confirm } from "./confirm.jsx";
import { photo } from "./photo.js";
import { act, busy, canAsk, canStart, endOf, link, run, status } from "./state.js";
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
  const { job, phase, message, progress, remaining_s, run: name } = run.value;
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
  const { answer, arguments: given } = status.value.proposal;
  return (
    <section class="card" id="proposal">
      <h2>{given?.filament ? texts.waitsFor(given.filament) : texts.waits}</h2>
      <Words words={answer} />
      <p class="buttons">
        <button
          id="use-proposal"
          class="primary"
          disabled={!canStart.value}
          onClick={() => act("start", { job: "apply", arguments: {} })}
        >
          {texts.use}
        </button>
        <button id="drop" disabled={!canAsk.value} onClick={() => act("dismiss", {}, texts.dropped)}>
          {texts.drop}
        </button>
      </p>
    </section>
  );
}

function LastRun() {
  const done = run.value.end === "done";
  const photograph = done && run.value.job === "photo_pattern";
  return (
    <p id="last-run" class={photograph ? "" : "quiet small"}>
      <span aria-hidden="true">{done ? "✓ " : "! "}</span>
      {photograph ? texts.nowPhotograph : endOf(run.value)}
    </p>
  );
}
