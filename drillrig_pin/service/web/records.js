// How the service's records are read by the page, in one place.

/** The share of a job that is done, from 0 to 1; nothing if it is not known. */
export function shareOf(record) {
  const {progress} = record;
  if (progress === null || progress === undefined) return null;
  return typeof progress === "number" ? progress : progress.total ? progress.done / progress.total : null;
}

/** Numbers that lists of runs show, the most telling first. */
const TELLING = [/^hole\.toe_6m\.worst$/, /^hole\..*\.worst$/, /\.across\.rms$/, /\.rms$/, /\.p_max$/, /\.range$/];

/** Up to three kinds of numbers, chosen by what the runs have. */
export function sharedKeys(runs, most = 3) {
  const all = [...new Set(runs.flatMap((run) => Object.keys(run.numbers ?? {})))];
  const ranked = TELLING.map((pattern) => all.find((key) => pattern.test(key))).filter(Boolean);
  return [...new Set([...ranked, ...all])].slice(0, most);
}

/** Quantities by key. */
export const byKey = (quantities) => Object.fromEntries(quantities.map((quantity) => [quantity.key, quantity]));

const LEVELS = {good: "good", note: "note", "near the limit": "near", "over the limit": "bad"};

/** The class and the word a level is shown with. */
export const levelOf = (level) => LEVELS[level] ?? "note";
