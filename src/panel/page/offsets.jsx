import { useRef, useState } from "preact/hooks";
import { Job, reasonAgainst, startJob } from "./jobs.jsx";
import { canStart, printer, say, status } from "./state.js";
import { texts } from "./texts.js";
import { mediaType, send } from "./upload.js";

/** Tool offsets by a sheet of paper: printed here, scanned elsewhere, measured here. */
export function Offsets() {
  if (!status.value?.jobs.some(({ job }) => job === "offset_sheet")) return null;
  return (
    <details id="offsets" class="card">
      <summary>{texts.toolOffsets}</summary>
      <div class="fold">
        <Job
          job="offset_sheet"
          words={texts.printSheet}
          title={texts.paperQuestion}
          detail={texts.sheetDetail}
          yes={texts.sheetYes}
          fields={["tools", "material"]}
        />
        <Scan />
      </div>
    </details>
  );
}

function Scan() {
  const file = useRef();
  const [sending, setSending] = useState(null); // {sent, total, stop}
  const reason = reasonAgainst("offset_scan");
  if (reason) return <p class="quiet small">{texts.cannot(texts.measureSheet, reason)}</p>;
  if (sending) return <Sending {...sending} />;
  return (
    <div class="job">
      <button id="offset_scan" disabled={!canStart.value} onClick={() => file.current.click()}>
        {texts.measureSheet}
      </button>
      <p class="quiet small">{texts.measureSheetDetail}</p>
      <input
        ref={file}
        id="sheet"
        type="file"
        hidden
        accept=".pdf,.png,.jpg,.jpeg,.tif,.tiff"
        aria-label={texts.measureSheet}
        onChange={({ target }) => target.files[0] && measure(target.files[0], setSending)}
      />
    </div>
  );
}

async function measure(scan, setSending) {
  const stop = new AbortController();
  const show = (sent) => setSending({ sent, total: scan.size, stop });
  show(0);
  try {
    const address = `sheets?printer=${printer.value}`;
    const { file } = await send(address, scan, mediaType(scan), { progressed: show, signal: stop.signal });
    await startJob("offset_scan", { file });
  } catch (error) {
    if (!stop.signal.aborted) say(error.message, "bad");
  }
  setSending(null);
}

function Sending({ sent, total, stop }) {
  return (
    <>
      <p>{texts.sendingSheet}</p>
      <progress aria-label={texts.sendingSheet} max={total} value={sent} />
      <p class="quiet">{texts.megabytes(sent, total)}</p>
      <p class="buttons">
        <button onClick={() => stop.abort()}>{texts.cancel}</button>
      </p>
    </>
  );
}
