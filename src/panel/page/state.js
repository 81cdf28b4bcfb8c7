// The state of the page: what the service reported last, and the requests to it.
import { computed, effect, signal } from "@preact/signals";
import { callBack } from "./alert.js";
import { connect, LinkLost } from "./connection.js";
import { remember, remembered } from "./stored.js";
import { texts } from "./texts.js";

const STATUS_EVERY_MS = 10000; // the longest time that a changed blocker stays unseen
const STATUS_PATIENCE_MS = 8000;
const WORDS_STAY_MS = 8000;

const query = new URLSearchParams(location.search);
export const embedded = query.get("embed") === "1";
export const theme = query.get("theme");

export const link = signal("connecting"); // connecting, up, lost
export const printers = signal([]);
export const printer = signal(0);
export const surveys = signal(false); // the service can survey a part
export const status = signal(null);
export const said = signal({ words: "", kind: "" });
export const pending = signal(false); // a request of the owner has no answer yet
const storedChanges = signal(0); // grows whenever stored results may have changed

export const printerName = computed(
  () => printers.value.find((one) => one.printer === printer.value)?.name ?? status.value?.printer.address ?? "",
);
export const run = computed(() => status.value?.run ?? null);
export const busy = computed(() => Boolean(run.value && !run.value.complete));
export const ready = computed(() => status.value?.printer.readiness === "ready");
export const canAsk = computed(() => link.value === "up" && !pending.value);
export const canStart = computed(() => canAsk.value && ready.value && !busy.value);

/** Puts words into the status line: errors ("bad") until the next words, others for a while. Words that the page shows
 * elsewhere ("heard") are for screen readers alone. */
export function say(words, kind = "") {
  clearTimeout(silence);
  said.value = { words, kind };
  if (kind !== "bad") silence = setTimeout(() => (said.value = { words: "", kind: "" }), WORDS_STAY_MS);
}

let silence;

export function blockerOf(job) {
  const found = status.value?.jobs.find((one) => one.job === job);
  return found ? found.blocker : texts.notKnown;
}

/** Promises the result of a method for the chosen printer. */
export function ask(method, params = {}, patienceMs) {
  return connection.call(method, { printer: printer.value, ...params }, patienceMs);
}

/** Asks on the owner's behalf. Reports an error in the status line and returns undefined then. */
export async function act(method, params, success = "") {
  pending.value = true;
  try {
    const result = await ask(method, params);
    if (success) say(success);
    refresh();
    return result;
  } catch (error) {
    reportError(error);
  } finally {
    pending.value = false;
  }
}

export function reportError(error) {
  if (!(error instanceof LinkLost)) say(error.message, "bad");
}

export function choosePrinter(number) {
  printer.value = number;
  remember("printer", printerName.value);
  status.value = null;
  refresh();
}

let asked = 0;
async function refresh() {
  const mine = ++asked;
  try {
    const answer = await ask("status", {}, STATUS_PATIENCE_MS);
    if (mine === asked && answer?.printer) take(answer);
  } catch (error) {
    reportError(error);
  }
}

/** Takes a status. Calls the owner back when a run ended, or an answer began to wait, since the last one. */
function take(next) {
  const before = status.value;
  status.value = next;
  if (!before) return;
  if (busy.value && next.run.phase !== before.run?.phase) say(texts.inPhase(texts.job(next.run.job), texts.phase(next.run.phase)), "heard");
  const ended = before.run && !before.run.complete && (next.run?.run !== before.run.run || next.run.complete);
  const waits = next.proposal && next.proposal.run !== before.proposal?.run;
  if (!ended && !waits) return;
  callBack();
  if (ended) storedChanged();
  if (waits) say(`${texts.waits}: ${next.proposal.answer}`, "heard");
  else if (next.run) say(endOf(next.run), "heard");
}

export function endOf(one) {
  const shown = ["apply", "undo"].includes(one.job) && one.end === "done"; // the value in force says it
  return [texts.lastRun(texts.job(one.job), texts.end(one.end)), !shown && one.message].filter(Boolean).map(sentence).join(". ");
}

const sentence = (words) => words[0].toUpperCase() + words.slice(1);

export function storedChanged() {
  storedChanges.value++;
}

/**
 * Keeps what a method answers for the chosen printer: take(answer) at first, and again whenever stored results may have changed
 * or a signal in `params()` did. take(null) forgets another printer's.
 */
export function followStored(method, params, take) {
  let asked = 0;
  let of;
  effect(() => {
    storedChanges.value; // asks again
    const given = params();
    if (embedded || link.value !== "up") return;
    const mine = ++asked;
    if (of !== printer.value) {
      of = printer.value;
      take(null);
    }
    ask(method, given).then((answer) => mine === asked && take(answer), reportError);
  });
}

async function opened() {
  const again = link.value === "lost";
  try {
    const known = await connection.call("printers");
    printers.value = known.printers;
    surveys.value = Boolean(known.surveys);
    say(again ? texts.back : "");
  } catch (error) {
    if (error instanceof LinkLost) return;
    reportError(error);
  }
  const wanted = remembered("printer");
  const found = status.value === null && printers.value.find((one) => one.name === wanted);
  if (found) printer.value = found.printer;
  link.value = "up";
  refresh();
}

function lost() {
  link.value = "lost";
}

function notified(method, params) {
  if (params.printer !== printer.value) return;
  if (method === "run" && params.run && status.value) {
    asked++; // an older answer may not undo this
    take({ ...status.value, run: params.run });
    if (params.run.complete) refresh();
  }
  if (method === "changed") refresh();
}

let connection;

export function start() {
  connection = connect("ws", { opened, lost, notified });
  const look = () => {
    connection.retryNow();
    if (link.value === "up") refresh();
  };
  setInterval(() => document.hidden || look(), STATUS_EVERY_MS);
  addEventListener("online", look);
  document.addEventListener("visibilitychange", () => document.hidden || look());
}
