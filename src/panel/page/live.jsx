import { useState } from "preact/hooks";
import { useNext } from "./next.js";
import { texts } from "./texts.js";

const PAUSE_MS = 500;

/** The newest frame of the camera that a run records by. Asks for one at a time, and for none while nobody looks. */
export function Live({ run }) {
  const [number, setNumber] = useState(1);
  const [answer, setAnswer] = useState(null); // {loaded}
  useNext(answer, PAUSE_MS, () => setNumber(number + 1));
  return (
    <img
      id="live"
      hidden={!answer?.loaded}
      src={`runs/${encodeURIComponent(run)}/now.jpg?${number}`}
      alt={texts.live}
      onLoad={() => setAnswer({ loaded: true })}
      onError={() => setAnswer({ loaded: false })}
    />
  );
}
