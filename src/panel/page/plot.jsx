const LEFT = 20; // of 100 across, for the numbers
const RIGHT = 96;
const TOP_PX = 22;
const BOTTOM_PX = 160;
export const HEIGHT_PX = 200;
const STEPS_ACROSS = 4;
const STEPS_UP = 8;

/** Returns round numbers within [from, to], each with its text. */
function ticksOf([from, to], mostSteps) {
  const power = 10 ** Math.floor(Math.log10((to - from) / mostSteps));
  const step = power * [1, 2, 5, 10].find((times) => (to - from) / (power * times) <= mostSteps);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const ticks = [];
  for (let i = Math.ceil(from / step); i <= to / step; i++) ticks.push([i * step, (i * step).toFixed(decimals)]);
  return ticks;
}

/** Returns the range of values, a little wider on both sides. */
export function rangeOf(values) {
  const [from, to] = [Math.min(...values), Math.max(...values)];
  const more = 0.06 * (to - from) || 1e-3;
  return [from - more, to + more];
}

/**
 * Axes with numbers. `x` and `y` are ranges [from, to], `xTicks` pairs [at, text]. `children(across, down)` draws: across(x) is
 * a number of percents, down(y) one of pixels. `picked(distance)` is called at a touch: distance(x, y) is that to it, in px.
 */
export function Plot({ name, x, y, unit, xTicks = ticksOf(x, STEPS_ACROSS), xName, picked, children }) {
  const across = (at) => LEFT + ((RIGHT - LEFT) * (at - x[0])) / (x[1] - x[0]);
  const down = (at) => BOTTOM_PX - ((BOTTOM_PX - TOP_PX) * (at - y[0])) / (y[1] - y[0]);
  const touched = ({ currentTarget, clientX, clientY }) => {
    const { left, top, width } = currentTarget.getBoundingClientRect();
    picked((atX, atY) => Math.hypot((across(atX) / 100) * width - (clientX - left), down(atY) - (clientY - top)));
  };
  const anchor = (at) => (across(at) > 85 ? "end" : across(at) < 25 ? "start" : "middle");
  return (
    <svg class={picked ? "plot touchable" : "plot"} role="img" aria-label={name} height={HEIGHT_PX} onClick={picked && touched}>
      {ticksOf(y, STEPS_UP).map(([at, text]) => (
        <g key={text}>
          <line class="grid" x1={`${LEFT}%`} x2={`${RIGHT}%`} y1={down(at)} y2={down(at)} />
          <text x={`${LEFT - 1.5}%`} y={down(at) + 4} text-anchor="end">
            {text}
          </text>
        </g>
      ))}
      <text x="0" y="11">
        {unit}
      </text>
      {xTicks.map(([at, text]) => (
        <text key={at} x={`${across(at)}%`} y={BOTTOM_PX + 17} text-anchor={anchor(at)}>
          {text}
        </text>
      ))}
      {xName && (
        <text x={`${RIGHT}%`} y={BOTTOM_PX + 33} text-anchor="end">
          {xName}
        </text>
      )}
      {children(across, down)}
    </svg>
  );
}
