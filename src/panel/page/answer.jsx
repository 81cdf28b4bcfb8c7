import { Bar } from "./bar.jsx";
import { Copy } from "./copy.jsx";
import { ChooseButton } from "./photo.jsx";
import { photo, setting, use } from "./photo.js";
import { Pictures, Report } from "./pictures.jsx";
import { canStart, embedded, printerName, ready } from "./state.js";
import { texts } from "./texts.js";
import { Verdict } from "./verdict.jsx";
import { Words } from "./words.jsx";

/** A measured photo: its answer, or the reason for none. */
export function Answer() {
  if (photo.value?.step !== "done") return null;
  const { result } = photo.value;
  return result.verdict === "good" ? <Good result={result} /> : <Refusal result={result} />;
}

function Good({ result }) {
  return (
    <section class="card" id="answer">
      <h2>
        {texts.answer} <Verdict verdict="good" />
      </h2>
      <Words words={result.words} />
      <Bar value={result.value_s} interval={result.interval95_s} />
      <Use keep={result.lines?.find((line) => line.firmware === "Klipper")?.keep} />
      {result.notices.map((notice) => (
        <p key={notice} class="notice">
          {notice}
        </p>
      ))}
      {!embedded && (
        <>
          <Copy lines={result.lines} />
          <Pictures run={result.run} pictures={result.pictures} />
          <Report run={result.run} report={result.report} />
        </>
      )}
      <ChooseButton words={texts.photographAnother} plain />
    </section>
  );
}

function Use({ keep }) {
  const name = printerName.value;
  const set = setting.value;
  if (set?.complete && set.end === "done") {
    return (
      <p id="used" class="good">
        <span aria-hidden="true">✓ </span>
        {texts.used(name, keep)}
      </p>
    );
  }
  return (
    <>
      <p class="buttons">
        <button id="use" class="primary" disabled={!canStart.value} onClick={use}>
          {set && !set.complete ? texts.using : texts.useOn(name)}
        </button>
      </p>
      {!ready.value && <p class="quiet">{texts.needReady(name)}</p>}
      {set?.complete && <p class="warning">{set.message}</p>}
    </>
  );
}

function Refusal({ result }) {
  const { run, pictures, report } = result;
  return (
    <section class="card" id="refusal">
      <Verdict verdict={result.verdict} />
      <h2>{result.words}</h2>
      <ChooseButton words={texts.photographAnother} />
      {!embedded && (
        <Pictures run={run} pictures={pictures} first={pictures.includes("photo.png") ? "photo.png" : pictures[0]} />
      )}
      {result.notices.map((notice) => (
        <p key={notice} class="notice">
          {notice}
        </p>
      ))}
      {!embedded && <Report run={run} report={report} />}
    </section>
  );
}
