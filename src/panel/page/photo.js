// A photo's way: chosen, sent, measured, answered. The answers of this visit are kept to be compared.
import { computed, effect, signal } from "@preact/signals";
import { callBack } from "./alert.js";
import { LinkLost } from "./connection.js";
import { act, ask, link, run, say, storedChanged } from "./state.js";
import { remember, remembered, rememberedInVisit, rememberInVisit } from "./stored.js";
import { texts } from "./texts.js";
import { mediaType, send } from "./upload.js";

const MOST_TRIES = 20;
const MEASURE_PATIENCE_MS = 120000; // a small computer beside the printer needs 10 s

export const choosing = signal(false);
export const choice = signal({ pattern: remembered("pattern", "trammel"), gcode: null, filament: "" });
/** The photo on the screen: {step: sending|measuring|failed|done, file, sent, total, error, at, result, filament, used}. */
export const photo = signal(null);
/** The measured photos of this visit, newest first. They outlast a reload: phones reload pages behind the camera. */
export const tries = signal(triesOfVisit());

/** The run that sets the photo's value on the printer, if it was asked for. */
export const setting = computed(() => (photo.value?.used && photo.value.used === run.value?.run ? run.value : null));

let sending;

// The pattern that was just printed is the one to be photographed.
let printed;
effect(() => {
  const last = run.value;
  if (last?.job !== "photo_pattern" || last.end !== "done" || last.run === printed) return;
  printed = last.run;
  change({ pattern: "trammel", gcode: null, filament: last.arguments?.filament ?? "" });
});

// What a print or a scan finds is not the photo's answer.
effect(() => {
  const now = run.value;
  if (!now || now.complete || ["apply", "undo", "photo"].includes(now.job)) return;
  if (photo.peek()?.step === "done") photo.value = null;
});

function triesOfVisit() {
  try {
    return JSON.parse(rememberedInVisit("tries", "[]"));
  } catch {
    return [];
  }
}

function keep(measured) {
  photo.value = measured;
  const others = tries.peek().filter((one) => one.result.run !== measured.result.run);
  tries.value = [measured, ...others].slice(0, MOST_TRIES);
  rememberInVisit("tries", JSON.stringify(tries.value));
}

export function change(part) {
  choice.value = { ...choice.peek(), ...part };
  if (part.pattern) remember("pattern", part.pattern);
}

export function forget() {
  sending?.abort();
  photo.value = null;
}

/** Sends and measures a file. Every outcome is shown in `photo`. */
export async function measurePhoto(file) {
  sending?.abort();
  const mine = (sending = new AbortController());
  const { pattern, gcode } = choice.value;
  const filament = choice.value.filament.trim();
  const show = (part) => !mine.signal.aborted && (photo.value = { ...photo.value, ...part });
  const total = file.size + (gcode?.size ?? 0);
  photo.value = { step: "sending", file, sent: 0, total };
  scrollTo(0, 0); // to the answer
  try {
    const { run } = await send("photos", file, mediaType(file), {
      progressed: (bytes) => show({ sent: bytes }),
      signal: mine.signal,
    });
    if (gcode) {
      await send(`gcodes?run=${encodeURIComponent(run)}`, gcode, "application/octet-stream", {
        progressed: (bytes) => show({ sent: file.size + bytes }),
        signal: mine.signal,
      });
    }
    show({ step: "measuring", sent: total });
    // The file that was printed names its own pattern.
    const result = await measure({ run, ...(gcode ? {} : { pattern }), ...(filament && { filament }) });
    if (mine.signal.aborted) return;
    const done = { step: "done", at: Date.now(), result, filament, used: null };
    keep(done);
    storedChanged();
    const words = result.verdict === "good" ? texts.measured : texts.notMeasured;
    say(words(result.words), "heard");
    callBack();
  } catch (error) {
    if (mine.signal.aborted) return;
    show({ step: "failed", error: error.message, arrived: photo.value.step === "measuring" });
    say(error.message, "heard");
  }
}

// The photo waits at the service: after a lost link it is measured again, not sent again.
async function measure(params) {
  for (;;) {
    try {
      return await ask("measure", params, MEASURE_PATIENCE_MS);
    } catch (error) {
      if (!(error instanceof LinkLost)) throw error;
      await linkUp();
    }
  }
}

function linkUp() {
  return new Promise((resolve) => {
    const stop = link.subscribe((now) => now === "up" && setTimeout(() => (stop(), resolve())));
  });
}

export async function use() {
  const mine = photo.value;
  const { run } = mine.result;
  const answer = await act("use", { run, ...(mine.filament && { filament: mine.filament }) });
  if (answer && photo.value === mine) keep({ ...mine, used: answer.run });
}
