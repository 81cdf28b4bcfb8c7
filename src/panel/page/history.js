// The stored results of the chosen printer, and what the owner does with them.
import { computed, signal } from "@preact/signals";
import { act, ask, choosePrinter, followStored, printer, storedChanged } from "./state.js";
import { texts } from "./texts.js";

const ROWS = 20; // at first, and more at each touch
const FIRST_READ = 200;
const MOST_READ = 1000; // the service lists no more
const NO_FILTER = { instrument: "", filament: "" };

/** The results, newest first. */
export const results = signal([]);
export const filter = signal(NO_FILTER);
/** The folder of the result whose details are open. */
export const chosen = signal("");
export const rows = signal(ROWS);
const reads = signal(FIRST_READ);

export const filtered = computed(() => {
  const { instrument, filament } = filter.value;
  return results.value.filter(
    (one) => (!instrument || one.instrument === instrument) && (!filament || one.subject?.filament === filament),
  );
});

const unread = computed(() => results.value.length === reads.value && reads.value < MOST_READ);
export const hasMore = computed(() => filtered.value.length > rows.value || unread.value);

followStored("history", () => ({ last: reads.value }), (answer) => {
  if (answer) {
    results.value = answer.results;
    return;
  }
  results.value = [];
  filter.value = NO_FILTER;
  chosen.value = "";
  rows.value = ROWS;
  reads.value = FIRST_READ;
});

export function showMore() {
  rows.value += ROWS;
  if (rows.value > filtered.value.length && unread.value) reads.value = MOST_READ;
}

export function choose(one) {
  chosen.value = chosen.value === one.folder ? "" : one.folder;
  rows.value = Math.max(rows.value, filtered.value.indexOf(one) + 1);
}

/** The last change on the printer by a result, or undefined. */
export const lastSet = (one) => one.applied?.filter(({ here }) => here !== false).at(-1);

/** Tells whether a result was the last of its instrument that was set, and still is. */
export function canTakeBack(one) {
  const changes = results.value.filter(({ instrument }) => instrument === one.instrument).map(lastSet).filter(Boolean);
  const mine = lastSet(one);
  return mine?.step === "applied" && changes.every(({ utc }) => utc <= mine.utc);
}

export async function annotate({ run }, part) {
  const noted = await act("annotate", { run, ...part });
  if (!noted) return false;
  results.value = results.value.map((one) => (one.run === run ? { ...one, note: noted.note, pinned: noted.pinned } : one));
  return true;
}

export async function remove({ run }) {
  if (await act("delete", { run }, texts.deleted)) storedChanged();
}

/** Sets a result on a printer of the service, whose run is shown then. */
export async function setOn({ run, instrument, subject }, number) {
  const filament = instrument === "pressure_advance" && subject?.filament;
  const answer = await act("use", { printer: number, run, ...(filament && { filament }) });
  if (answer && number !== printer.value) choosePrinter(number);
}

export const takeBack = ({ instrument, run }) => act("undo", { instrument, run });

export const compare = (before, after) => ask("compare", { before: before.run, after: after.run });
