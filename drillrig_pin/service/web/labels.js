// Names of the numbers of a run in the reader's language, made from their keys (`S.across.rms`, `hole.toe_6m.worst`).

import {t, translated, written} from "./i18n.js";
import {shown, typing, withUnit} from "./units.js";

/** The name of a number; what is no key of the analysis keeps the label the server gave it. */
export function quantityLabel(key, label = key) {
  const parts = key.split(".");
  const first = parts.shift(), last = parts.pop(), between = parts.join(".");
  if (first === "hole") return t(`quantity.hole.${last}`, {measure: measureLabel(between)});
  const whole = translated(`quantity.${key}`, null);
  if (whole) return whole;
  const kind = between === "across" ? "across.rms" : last === "greatest" && /moment/.test(label) ? "greatest_moment" : last;
  const text = translated(`quantity.${kind}`, null);
  if (!text) return label;
  return t(`quantity.${kind}`, text.includes("{axis}") || between === "across" ? {name: first, axis: between} : {name: [first, between].filter(Boolean).join(".")});
}

/** `toe_6m` as "Toe offset at 6 m". */
export function measureLabel(name) {
  const toe = /^toe_(.+)m$/.exec(name);
  return toe ? t("measure.toe", {depth: toe[1]}) : translated(`measure.${name}`, name);
}

/** `model.boom_length` as "boom_length", `scenario.integrator.rtol` as "integrator.rtol". */
export function axisLabel(name) {
  return name.replace(/^(model|scenario)\./, "");
}

/** The name of a group of parameters: known kinds are translated, names of parts are written with spaces. */
export function groupLabel(group) {
  const words = group.replace(/_/g, " ");
  return translated(`group.${group}`, words.charAt(0).toUpperCase() + words.slice(1));
}

/** What was changed in a run, in a few words and the units people read. */
export function changesLabel(given, units = {}, most = 3) {
  const entries = Object.entries(given ?? {});
  const words = entries.slice(0, most).map(([name, value]) => `${name} = ${typedWords(value, units[name])}`);
  return entries.length > most ? `${words.join(", ")} … +${entries.length - most}` : words.join(", ");
}

/** Joints that a run locks beyond its model, as a fact of it; nothing without. */
export function locksLabel(run) {
  return run.lock?.length ? t("runs.locked", {joints: run.lock.join(", ")}) : null;
}

/** A number of a model as it is typed, with its unit; a word as it is. */
export function typedWords(value, unit) {
  if (unit === undefined || unit === "word" || typeof value !== "number") return String(value);
  const scale = typing(unit, value);
  return withUnit(written(String(shown(value, scale.factor))), scale.unit);
}

/** A badge that tells how a run or a study stands. */
export function statusLabel(status) {
  return translated(`status.${status}`, status);
}
