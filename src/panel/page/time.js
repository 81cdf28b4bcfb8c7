const known = (when, options) => (Number.isNaN(when.getTime()) ? "" : when.toLocaleString([], options));

/** Returns the time of day of a time in ms since 1970. */
export const timeOf = (ms) => known(new Date(ms), { timeStyle: "short" });

/** Returns day and time of a UTC text, as the owner writes them. */
export const dayOf = (utc) => known(new Date(utc), { dateStyle: "medium", timeStyle: "short" });

/** Returns a time in ms since 1970 for an axis: its day, or its time of day. */
export const axisTime = (ms, days) => (days ? known(new Date(ms), { dateStyle: "medium" }) : timeOf(ms));

const DAY_MS = 86400000;

/** Returns how long ago a UTC text was: "12 days ago". */
export function agoOf(utc) {
  const days = Math.max(0, Math.floor((Date.now() - Date.parse(utc)) / DAY_MS));
  return Number.isNaN(days) ? "" : new Intl.RelativeTimeFormat("en", { numeric: "auto" }).format(-days, "day");
}
