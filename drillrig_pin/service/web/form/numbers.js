// What people type, as numbers, and back.

import {currentLanguage, t, written} from "../i18n.js";

/** The number a text stands for; NaN for anything else. A comma is a decimal sign only in languages that write it so. */
export function parsed(text) {
  let plain = text.trim().replace(/\u2212/g, "-");
  if (currentLanguage() === "vi") plain = plain.replace(",", ".");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}

/** A number as it stands in an input. */
export const typed = (value) => written(String(value));

/** Why a value does not lie in its range, in words; empty if it does. All three in the unit people type. */
export function outside(value, {low, high, lowExcluded}, unit) {
  const within = (low === null || value > low || (value === low && !lowExcluded)) && (high === null || value <= high);
  if (within) return "";
  return t("field.outside", {range: rangeWords({low, high, lowExcluded}, unit)});
}

/** A range in words: "0 … 5000 mm", "> 0 s"; empty without one. */
export function rangeWords({low, high, lowExcluded}, unit) {
  const space = unit && unit !== "°" ? " " : "";
  if (low === null && high === null) return "";
  if (high === null) return `${lowExcluded ? ">" : "≥"} ${typed(low)}${space}${unit}`;
  if (low === null) return `≤ ${typed(high)}${space}${unit}`;
  return `${lowExcluded ? "> " : ""}${typed(low)} … ${typed(high)}${space}${unit}`;
}
