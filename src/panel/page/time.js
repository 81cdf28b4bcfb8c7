const known = (when, options) => (Number.isNaN(when.getTime()) ? "" : when.toLocaleString([], options));

/** Returns the time of day. */
export const timeOf = (when) => known(when, { timeStyle: "short" });

/** Returns day and time of a UTC text, as the owner writes them. */
export const dayOf = (utc) => known(new Date(utc), { dateStyle: "medium", timeStyle: "short" });
