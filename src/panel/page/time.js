const known = (when, options) => (Number.isNaN(when.getTime()) ? "" : when.toLocaleString([], options));

/** Returns the time of day of a time in ms since 1970. */
export const timeOf = (ms) => known(new Date(ms), { timeStyle: "short" });

/** Returns day and time of a UTC text, as the owner writes them. */
export const dayOf = (utc) => known(new Date(utc), { dateStyle: "medium", timeStyle: "short" });
