import { Plot, rangeOf } from "./plot.jsx";
import { texts } from "./texts.js";
import { axisTime } from "./time.js";

const HOUR_MS = 3600000;

/** Values over time with their 95 % intervals: `points` are {id, at (ms), value, interval, filled}. */
export function Points({ name, points, unit, chosen, choose }) {
  if (points.length < 2) return null;
  const times = points.map(({ at }) => at);
  const first = Math.min(...times);
  const last = Math.max(Math.max(...times), first + 1);
  const margin = 0.02 * (last - first);
  const picked = (distance) => {
    const far = points.map(({ at, value }) => distance(at, value));
    choose(points[far.indexOf(Math.min(...far))].id);
  };
  return (
    <Plot
      name={texts.chart(name, points.length)}
      x={[first - margin, last + margin]}
      y={rangeOf(points.flatMap(({ interval }) => interval))}
      unit={unit}
      xTicks={[first, last].map((at) => [at, axisTime(at, last - first > 20 * HOUR_MS)])}
      picked={picked}
    >
      {(across, down) =>
        points.map(({ id, at, value, interval, filled }) => (
          <g key={id} class={filled ? "point filled" : "point"}>
            <line x1={`${across(at)}%`} x2={`${across(at)}%`} y1={down(interval[0])} y2={down(interval[1])} />
            <circle cx={`${across(at)}%`} cy={down(value)} r={id === chosen ? 8 : 5} />
          </g>
        ))
      }
    </Plot>
  );
}
