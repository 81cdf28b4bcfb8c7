import { Chart } from "./chart.jsx";
import { canTakeBack, choose, chosen, filter, filtered, hasMore, lastSet, results, rows, showMore } from "./history.js";
import { Result } from "./result.jsx";
import { Row } from "./row.jsx";
import { printer } from "./state.js";
import { texts } from "./texts.js";
import { dayOf } from "./time.js";
import { Verdict } from "./verdict.jsx";

/** The results of this printer, newest first. */
export function History() {
  return (
    <section id="history">
      <h2>{texts.history}</h2>
      {results.value.length === 0 ? <p class="quiet">{texts.noHistory}</p> : <Results />}
    </section>
  );
}

function Results() {
  return (
    <>
      <Filters />
      <Chart results={filtered.value} />
      <table class="rows">
        <thead>
          <tr>
            {texts.columns.map((column) => (
              <th key={column}>{column}</th>
            ))}
          </tr>
        </thead>
        <tbody>
          {filtered.value.slice(0, rows.value).map((one) => (
            <ResultRow key={one.folder} one={one} />
          ))}
        </tbody>
      </table>
      <p class="buttons">
        {hasMore.value && (
          <button id="more-rows" onClick={showMore}>
            {texts.showMore}
          </button>
        )}
        <a id="export" class="touch" href={`history.csv?printer=${printer.value}`} download>
          {texts.exportTable}
        </a>
      </p>
    </>
  );
}

function ResultRow({ one }) {
  const step = lastSet(one)?.step;
  const set = texts.step(step === "applied" && !canTakeBack(one) ? "before" : step);
  return (
    <Row
      open={chosen.value === one.folder}
      toggle={() => choose(one)}
      cells={[
        dayOf(one.utc),
        [texts.instrument(one.instrument), one.subject?.filament].filter(Boolean).join(", "),
        <>
          {one.answers.length === 0 && <Outcome verdict={one.verdict} words={one.reason} />}
          {one.answers.map((answer) => (
            <Outcome key={answer.name} verdict={answer.verdict} words={answer.words} />
          ))}
          {one.note && <div class="quiet note">{one.note}</div>}
        </>,
        [set, one.pinned && texts.pinned].filter(Boolean).join(", "),
      ]}
    >
      <Result one={one} />
    </Row>
  );
}

function Outcome({ verdict, words }) {
  return (
    <div class="outcome">
      <Verdict verdict={verdict} /> {words}
    </div>
  );
}

/** The choices of what the list shows, where there is a choice. */
function Filters() {
  const options = (valueOf) => [...new Set(results.value.map(valueOf).filter(Boolean))].sort();
  const instruments = options((one) => one.instrument).map((value) => [value, texts.instrument(value)]);
  const filaments = options((one) => one.subject?.filament).map((value) => [value, value]);
  if (instruments.length < 2 && filaments.length < 2) return null;
  return (
    <div class="filters">
      <Filter part="instrument" name={texts.whichInstrument} options={instruments} />
      <Filter part="filament" name={texts.whichFilament} options={filaments} />
    </div>
  );
}

function Filter({ part, name, options }) {
  if (options.length < 2) return null;
  return (
    <label>
      {name}
      <select
        id={`only-${part}`}
        value={filter.value[part]}
        onChange={({ target }) => (filter.value = { ...filter.value, [part]: target.value })}
      >
        <option value="">{texts.all}</option>
        {options.map(([value, words]) => (
          <option key={value} value={value}>
            {words}
          </option>
        ))}
      </select>
    </label>
  );
}
