import { signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { ask, canAsk, reportError, say, surveys } from "./state.js";
import { remember, remembered } from "./stored.js";
import { texts } from "./texts.js";
import { mediaType, send } from "./upload.js";
import { Verdict } from "./verdict.jsx";

const PATIENCE_MS = 120000;
const FEWEST_PICTURES = 6; // of each target: docs/howto/part-alignment-survey.md
const NORMAL_95 = 1.96;

const run = signal(remembered("survey"));
const answer = signal(null);
const working = signal(""); // what is done now

/** A survey of a part, picture by picture, with what is still missing. */
export function Survey() {
  const [open, setOpen] = useState(false);
  useEffect(() => {
    if (open && run.value && !answer.value) solve({});
  }, [open]);
  if (!surveys.value) return null;
  return (
    <details id="survey" class="card" onToggle={({ target }) => setOpen(target.open)}>
      <summary>{texts.survey}</summary>
      {open && (
        <div class="fold">
          {answer.value ? <Outcome {...answer.value} /> : <p class="quiet">{texts.surveyAdvice}</p>}
          <Add />
          {answer.value && <Found {...answer.value} />}
        </div>
      )}
    </details>
  );
}

async function solve(given) {
  working.value = texts.measuring;
  try {
    answer.value = await ask("survey", { run: run.value, ...given }, PATIENCE_MS);
  } catch (error) {
    reportError(error);
  }
  working.value = "";
}

async function add(files) {
  for (const [i, file] of [...files].entries()) {
    working.value = texts.sendingPicture(i + 1, files.length);
    try {
      const address = `surveys?run=${encodeURIComponent(run.value)}`;
      const sent = await send(address, file, mediaType(file), { progressed() {}, signal: new AbortController().signal });
      run.value = sent.run;
      remember("survey", sent.run);
    } catch (error) {
      working.value = "";
      return say(error.message, "bad");
    }
    await solve({});
  }
}

function begin() {
  run.value = "";
  remember("survey", "");
  answer.value = null;
}

function Add() {
  const file = useRef();
  return (
    <>
      <p class="buttons">
        <button id="add-picture" class="primary" disabled={!canAsk.value || working.value} onClick={() => file.current.click()}>
          {texts.addPicture}
        </button>
        {run.value && (
          <button id="new-survey" disabled={working.value} onClick={begin}>
            {texts.newSurvey}
          </button>
        )}
      </p>
      {working.value && <p class="quiet">{working.value}</p>}
      <input
        ref={file}
        id="picture"
        type="file"
        hidden
        multiple
        accept="image/jpeg,image/png,image/tiff"
        aria-label={texts.addPicture}
        onChange={({ target }) => {
          add([...target.files]);
          target.value = "";
        }}
      />
    </>
  );
}

function Outcome({ verdict, reason, advice, unchecked, targets, files, run }) {
  const few = targets.filter((one) => one.pictures < FEWEST_PICTURES).map((one) => one.target);
  return (
    <>
      <p class="words">
        <Verdict verdict={verdict} /> {reason}
      </p>
      {few.length > 0 && <p>{texts.fewPictures(FEWEST_PICTURES, few)}</p>}
      {[...(advice ?? []), ...(unchecked ?? [])].map((words) => (
        <p key={words} class="notice">
          {words}
        </p>
      ))}
      {files.length > 0 && (
        <p class="buttons">
          {files.map((name) => (
            <a key={name} href={`runs/${encodeURIComponent(run)}/${name}`} target="_blank" rel="noopener">
              {texts.surveyFile(name)}
            </a>
          ))}
        </p>
      )}
    </>
  );
}

function Found({ pictures, targets, bars, notices }) {
  return (
    <>
      <Bars key={JSON.stringify(bars)} bars={bars} />
      <h2>{texts.pictures(pictures.length)}</h2>
      <table>
        <tbody>
          {pictures.map(({ picture, targets: count, reason }) => (
            <tr key={picture}>
              <td>{picture}</td>
              <td>
                {texts.targetsSeen(count)}
                {reason && `: ${reason}`}
              </td>
              <td>
                <button class="small" disabled={working.value} onClick={() => solve({ without: picture })}>
                  {texts.takeOut}
                </button>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
      <h2>{texts.targets(targets.length)}</h2>
      <table>
        <tbody>
          {targets.map(({ target, pictures: count, standard_uncertainty_mm: sigma }) => (
            <tr key={target}>
              <td>{target}</td>
              <td>{texts.seenIn(count)}</td>
              <td>{sigma ? texts.within95(NORMAL_95 * Math.max(...sigma)) : texts.notGiven}</td>
            </tr>
          ))}
        </tbody>
      </table>
      {notices.map((notice) => (
        <p key={notice} class="quiet small">
          {notice}
        </p>
      ))}
    </>
  );
}

const FIELDS = ["from", "to", "length_mm", "sigma_mm"];
const EMPTY = { from: "", to: "", length_mm: "", sigma_mm: "" };

/** The scale bars, which give the survey its lengths. */
function Bars({ bars }) {
  const [rows, setRows] = useState([...bars, EMPTY]);
  const write = (at, name, text) => {
    const next = rows.map((row, i) => (i === at ? { ...row, [name]: text } : row));
    setRows(at === rows.length - 1 ? [...next, EMPTY] : next);
  };
  const save = () =>
    solve({
      bars: rows
        .filter((row) => FIELDS.some((name) => row[name] !== ""))
        .map(({ from, to, length_mm, sigma_mm }) => ({ from, to, length_mm: number(length_mm), sigma_mm: number(sigma_mm) })),
    });
  return (
    <details id="bars" open={bars.length === 0}>
      <summary>{texts.bars(bars.length)}</summary>
      <p class="quiet small">{texts.barsAdvice}</p>
      {rows.map((row, i) => (
        <fieldset key={i} class="fields">
          <legend class="small">{texts.bar(i + 1)}</legend>
          {FIELDS.map((name) => (
            <label key={name}>
              {texts.barFields[name]}
              <input
                type="text"
                inputmode={name.endsWith("mm") ? "decimal" : "text"}
                value={row[name]}
                onInput={({ target }) => write(i, name, target.value)}
              />
            </label>
          ))}
        </fieldset>
      ))}
      <p class="buttons">
        <button id="save-bars" disabled={working.value} onClick={save}>
          {texts.saveBars}
        </button>
      </p>
    </details>
  );
}

const number = (text) => Number(String(text).replace(",", "."));
