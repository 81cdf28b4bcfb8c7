import { useState } from "preact/hooks";
import { canTakeBack, choose, chosen } from "./history.js";
import { Points } from "./points.jsx";
import { texts } from "./texts.js";

/** Returns the good answers by what they are of: [name, points], the series with the newest answer first. */
function seriesOf(results) {
  const series = new Map();
  for (const one of results) {
    const { filament, nozzle } = one.subject ?? {};
    for (const answer of one.answers.filter(({ value }) => value != null)) {
      const name = [texts.answerName(answer.name), filament, nozzle && texts.nozzle(nozzle)].filter(Boolean).join(", ");
      const points = series.get(name) ?? series.set(name, []).get(name);
      points.push({
        id: one.folder,
        at: Date.parse(one.utc),
        value: answer.value,
        interval: answer.interval95,
        unit: answer.unit,
        filled: canTakeBack(one),
      });
    }
  }
  return [...series].filter(([, points]) => points.length > 1);
}

/** The values of one filament and nozzle over time. */
export function Chart({ results }) {
  const [wanted, setWanted] = useState("");
  const series = seriesOf(results);
  if (series.length === 0) return null;
  const [name, points] = series.find(([each]) => each === wanted) ?? series[0];
  const touched = (id) => {
    chosen.value = "";
    choose(results.find(({ folder }) => folder === id));
  };
  return (
    <div id="chart">
      {series.length === 1 ? (
        <p>{name}</p>
      ) : (
        <label>
          {texts.chartOf}
          <select value={name} onChange={({ target }) => setWanted(target.value)}>
            {series.map(([each]) => (
              <option key={each}>{each}</option>
            ))}
          </select>
        </label>
      )}
      <Points name={name} points={points} unit={points[0].unit} chosen={chosen.value} choose={touched} />
      <p class="quiet small">{texts.chartLegend}</p>
    </div>
  );
}
