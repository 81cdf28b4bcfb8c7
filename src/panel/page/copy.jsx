import { useRef, useState } from "preact/hooks";
import { say } from "./state.js";
import { remember, remembered } from "./stored.js";
import { texts } from "./texts.js";

/** The line that sets the value, for each firmware. */
export function Copy({ lines }) {
  const [firmware, setFirmware] = useState(remembered("firmware"));
  const [done, setDone] = useState("");
  const field = useRef();
  if (!lines?.length) return null;
  const line = lines.find((one) => one.firmware === firmware) ?? lines[0];
  const choose = ({ target }) => {
    setFirmware(target.value);
    setDone("");
    remember("firmware", target.value);
  };
  const copy = async () => {
    const words = (await copied(field.current)) ? texts.copied : texts.copyByHand;
    setDone(words);
    say(words, "heard");
  };
  return (
    <div class="copy">
      <label>
        {texts.copyFor}
        <select id="firmware" value={line.firmware} onChange={choose}>
          {lines.map((one) => (
            <option key={one.firmware}>{one.firmware}</option>
          ))}
        </select>
      </label>
      <span class="line">
        <input ref={field} id="line" readonly value={line.text} aria-label={line.firmware} />
        <button id="copy" onClick={copy}>
          {texts.copy}
        </button>
      </span>
      <p class="small quiet">
        {done && <strong id="copied">{done}. </strong>}
        {line.keep && texts.keep(line.keep)}
      </p>
    </div>
  );
}

// Browsers hide the clipboard from pages without HTTPS. The old command still copies a selection there.
async function copied(field) {
  try {
    await navigator.clipboard.writeText(field.value);
    return true;
  } catch {
    field.focus();
    field.setSelectionRange(0, field.value.length);
    return document.execCommand("copy");
  }
}
