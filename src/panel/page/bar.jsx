import { status } from "./state.js";
import { texts } from "./texts.js";

const percent = (share) => `${(100 * share).toFixed(2)}%`;

/** The 95 % interval from zero on, with the value and the one in force. The words beside it have the numbers. */
export function Bar({ value, interval }) {
  const now = parseFloat(status.value?.in_force);
  const end = 1.15 * Math.max(interval[1], Number.isFinite(now) ? now : 0);
  if (!(interval[0] >= 0 && interval[0] <= value && value <= interval[1] && end > 0)) return null;
  const x = (at) => percent(at / end);
  return (
    <svg class="bar" aria-hidden="true" height="34">
      <rect class="axis" x="0" y="12" width="100%" height="2" />
      <rect class="range" x={x(interval[0])} y="6" width={x(interval[1] - interval[0])} height="14" rx="3" />
      <circle class="dot" cx={x(value)} cy="13" r="5" />
      <text x="0" y="32">
        0
      </text>
      {now / end > 0.1 && (
        <>
          <line class="now" x1={x(now)} x2={x(now)} y1="3" y2="22" />
          <text x={x(now)} y="32" text-anchor="middle">
            {texts.barNow}
          </text>
        </>
      )}
    </svg>
  );
}
