import { texts } from "./texts.js";

const SIGNS = { good: "✓", cannot_tell: "?", refused: "✕" };

/** A verdict by sign, word and colour. */
export function Verdict({ verdict }) {
  return (
    <span class={`verdict ${verdict}`}>
      <span aria-hidden="true">{SIGNS[verdict]} </span>
      {texts.verdict(verdict)}
    </span>
  );
}
