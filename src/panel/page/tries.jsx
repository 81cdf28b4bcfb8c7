import { photo, tries } from "./photo.js";
import { texts } from "./texts.js";
import { timeOf } from "./time.js";
import { Verdict } from "./verdict.jsx";

/** The measured photos of this visit, newest first. */
export function Tries() {
  if (!tries.value.some((one) => one.result.run !== photo.value?.result?.run)) return null;
  return (
    <section id="tries">
      <h2>{texts.tries}</h2>
      <table>
        <tbody>
          {tries.value.map((one) => (
            <tr key={one.result.run}>
              <td>{timeOf(one.at)}</td>
              <td>
                <Verdict verdict={one.result.verdict} /> {one.result.words}
              </td>
              <td>
                <button class="small" onClick={() => (photo.value = one)}>
                  {texts.show}
                </button>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}
