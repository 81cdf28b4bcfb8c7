import { Answer } from "./answer.jsx";
import { Due } from "./due.jsx";
import { History } from "./history.jsx";
import { Jobs } from "./jobs.jsx";
import { Now } from "./now.jsx";
import { Offsets } from "./offsets.jsx";
import { Photo } from "./photo.jsx";
import { Setup } from "./setup.jsx";
import { embedded, link, said, status } from "./state.js";
import { Survey } from "./survey.jsx";
import { texts } from "./texts.js";
import { Taps } from "./taps.jsx";
import { Tries } from "./tries.jsx";
import { Waiting } from "./waiting.jsx";

export function App() {
  return (
    <main>
      <Now />
      <div class="first">
        <Waiting />
        <Photo />
        <Due />
        <Answer />
        {!embedded && <Tries />}
        {!embedded && <Jobs />}
        {!embedded && <Offsets />}
        {!embedded && <Taps />}
        {!embedded && <Survey />}
        {embedded && <a class="whole" href="./" target="_blank">{texts.openPanel}</a>}
      </div>
      {!embedded && (
        <div class="more">
          <Setup />
          <History />
          {status.value && <p class="small">{texts.version(status.value.version)}</p>}
        </div>
      )}
      <StatusLine />
    </main>
  );
}

function StatusLine() {
  const { words, kind } = said.value;
  const lost = link.value === "lost";
  const shown = lost ? texts.lost : link.value === "connecting" ? texts.connecting : words;
  return (
    <p id="status" role="status" aria-live="polite" class={lost ? "lost" : kind}>
      {shown}
    </p>
  );
}
