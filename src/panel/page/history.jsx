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
                      words={answer.words}
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
