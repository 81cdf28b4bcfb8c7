import { useState } from "preact/hooks";
import { Confirm } from "./confirm.jsx";
import { annotate, canTakeBack, compare, filtered, lastSet, remove, setOn, takeBack } from "./history.js";
import { Pictures, Report } from "./pictures.jsx";
import { canAsk, canStart, printer, printerName, printers, reportError } from "./state.js";
import { texts } from "./texts.js";
import { agoOf, dayOf } from "./time.js";

const SETTABLE = ["pressure_advance", "tool_offset"];
const NOTE_BYTES = 500; // the service keeps no more

const canUse = (one) => Boolean(one.run) && one.verdict === "good" && SETTABLE.includes(one.instrument);

/** A result of the history in detail, and all that can be done with it. */
export function Result({ one }) {
  return (
    <div class="result">
      <Subject one={one} />
      {one.notices.map((notice) => (
        <p key={notice} class="notice">
          {notice}
        </p>
      ))}
      <div class="buttons">
        {canUse(one) && (
          <button class="primary use" disabled={!canStart.value} onClick={() => setOn(one, printer.value)}>
            {texts.useOn(printerName.value)}
          </button>
        )}
        {canTakeBack(one) && <TakeBack one={one} />}
      </div>
      {canUse(one) && <CopyTo one={one} />}
      {one.run ? (
        <>
          <Pictures run={one.run} pictures={one.pictures} instrument={one.instrument} />
          <Report run={one.run} report={one.report} />
          <Note one={one} />
          <Compare one={one} />
          <Keep one={one} />
        </>
      ) : (
        <p class="quiet">{texts.filesGone}</p>
      )}
    </div>
  );
}

function Subject({ one }) {
  const { printer: address, nozzle, nozzle_c, bed_c, toolhead, spool } = one.subject ?? {};
  const by = printers.value.find(({ subject }) => subject && subject === address);
  const facts = [
    (nozzle || nozzle_c) && texts.nozzleAt(nozzle, nozzle_c),
    bed_c && texts.bedAt(bed_c),
    toolhead,
    spool && texts.spool(spool),
  ];
  return <p class="quiet">{[texts.measuredOn(by?.name ?? address, agoOf(one.utc)), ...facts.filter(Boolean)].join(", ")}</p>;
}

function TakeBack({ one }) {
  const [asking, setAsking] = useState(false);
  return (
    <>
      <button class="take-back" disabled={!canStart.value} onClick={() => setAsking(true)}>
        {texts.takeBack}
      </button>
      <Confirm
        open={asking}
        close={() => setAsking(false)}
        title={texts.takeBackQuestion}
        detail={texts.takeBackDetail(one.instrument === "pressure_advance" ? lastSet(one).before : null)}
        yes={texts.takeBack}
        act={() => takeBack(one)}
        disabled={!canStart.value}
      />
    </>
  );
}

/** The other printers of the service with this nozzle. */
function CopyTo({ one }) {
  const like = printers.value.filter(
    (each) => each.printer !== printer.value && each.nozzle && each.nozzle === one.subject?.nozzle,
  );
  const [wanted, setWanted] = useState(null);
  if (like.length === 0) return null;
  const target = like.find((each) => each.printer === wanted) ?? like[0];
  return (
    <div class="line copy-to">
      <label>
        {texts.copyTo}
        <select value={target.printer} onChange={(event) => setWanted(Number(event.target.value))}>
          {like.map((each) => (
            <option key={each.printer} value={each.printer}>
              {each.name}
            </option>
          ))}
        </select>
      </label>
      <button disabled={!canAsk.value} onClick={() => setOn(one, target.printer)}>
        {texts.copyOver}
      </button>
    </div>
  );
}

function Note({ one }) {
  const [draft, setDraft] = useState(null);
  const text = draft ?? one.note ?? "";
  const bytes = new TextEncoder().encode(text).length;
  const save = async () => (await annotate(one, { note: text })) && setDraft(null);
  return (
    <>
      <label>
        {texts.note}
        <textarea class="note-field" rows="2" value={text} onInput={({ target }) => setDraft(target.value)} />
      </label>
      {draft !== null && (
        <p class="buttons">
          <button class="save-note" disabled={!canAsk.value || bytes > NOTE_BYTES} onClick={save}>
            {texts.saveNote}
          </button>
          {bytes > NOTE_BYTES && <span class="quiet">{texts.noteTooLong}</span>}
        </p>
      )}
    </>
  );
}

function Compare({ one }) {
  const others = filtered.value.filter((other) => other.run && other !== one && other.instrument === one.instrument);
  const [wanted, setWanted] = useState("");
  const [found, setFound] = useState(null);
  if (others.length === 0) return null;
  const choose = async ({ target }) => {
    const { value: run } = target;
    setWanted(run);
    const other = others.find((each) => each.run === run);
    if (!other) return;
    try {
      setFound({ run, ...(await (other.utc <= one.utc ? compare(other, one) : compare(one, other))) });
    } catch (error) {
      reportError(error);
    }
  };
  return (
    <>
      <label>
        {texts.compareWith}
        <select class="compare" value={wanted} onChange={choose}>
          <option value="">{texts.chooseOne}</option>
          {others.map((other) => (
            <option key={other.run} value={other.run}>
              {[dayOf(other.utc), other.subject?.filament, other.answers[0]?.words].filter(Boolean).join(", ")}
            </option>
          ))}
        </select>
      </label>
      {found?.run === wanted && <Changes {...found} />}
    </>
  );
}

function Changes({ changes, others }) {
  return (
    <div class="changes" role="status">
      {others.map((words) => (
        <p key={words} class="notice">
          {words}
        </p>
      ))}
      {changes.map(({ name, words, differs }) => (
        <p key={name} class={differs ? "differs" : ""}>
          {changes.length > 1 && `${name}: `}
          {words}
        </p>
      ))}
    </div>
  );
}

function Keep({ one }) {
  const [asking, setAsking] = useState(false);
  return (
    <div class="buttons">
      <button class="pin" disabled={!canAsk.value} onClick={() => annotate(one, { pinned: !one.pinned })}>
        {one.pinned ? texts.unpin : texts.pin}
      </button>
      <button class="danger delete" disabled={!canAsk.value} onClick={() => setAsking(true)}>
        {texts.delete}
      </button>
      <Confirm
        open={asking}
        close={() => setAsking(false)}
        title={texts.deleteQuestion}
        detail={texts.deleteDetail}
        yes={texts.delete}
        act={() => remove(one)}
        disabled={!canAsk.value}
        danger
      />
    </div>
  );
}
