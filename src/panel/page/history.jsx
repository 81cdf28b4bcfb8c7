import { results } from "./state.js";
import { texts } from "./texts.js";
import { dayOf } from "./time.js";
import { Verdict } from "./verdict.jsx";

/** The results of this printer, newest first. */
export function History() {
  const [when, what, result, set] = texts.columns;
  return (
    <section id="history">
      <h2>{texts.history}</h2>
      {results.value.length === 0 ? (
        <p class="quiet">{texts.noHistory}</p>
      ) : (
        <table>
          <thead>
            <tr>
              <th>{when}</th>
              <th>{what}</th>
              <th>{result}</th>
              <th>{set}</th>
            </tr>
          </thead>
          <tbody>
            {results.value.map((one) => (
              <tr key={one.folder}>
                <td>{dayOf(one.utc)}</td>
                <td>{[texts.instrument(one.instrument), one.subject?.filament].filter(Boolean).join(", ")}</td>
                <td>
                  {one.answers.length === 0 && <Outcome verdict={one.verdict} words={one.reason} />}
                  {one.answers.map((answer) => (
                    <Outcome
                      key={answer.name}
                      verdict={answer.verdict}
                      words={answer.verdict === "good" ? valueOf(answer) : answer.reason}
                    />
                  ))}
                </td>
                <td>{one.applied?.length > 0 && texts.set}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

function Outcome({ verdict, words }) {
  return (
    <div class="outcome">
      <Verdict verdict={verdict} /> {words}
    </div>
  );
}

// Two digits of the standard uncertainty decide how many decimals tell anything.
function valueOf({ value, unit, standard_uncertainty, interval95 }) {
  if (!interval95) return `${value} ${unit}`;
  const wanted = standard_uncertainty > 0 ? 1 - Math.floor(Math.log10(standard_uncertainty)) : 4;
  const text = (number) => number.toFixed(Math.min(Math.max(wanted, 0), 8));
  return `${text(value)} ${unit} (${texts.interval(text(interval95[0]), text(interval95[1]), unit)})`;
}
