// Numbers as people read them, from SI as the service gives them: significant digits, millimetres, degrees, bar.

import {t, written} from "./i18n.js";

const READ = {
  m: [["m", 1, 0.5], ["mm", 1e3, 1e-4], ["µm", 1e6, 0]],
  rad: [["°", 180 / Math.PI, 0]],
  Pa: [["bar", 1e-5, 0]],
  N: [["kN", 1e-3, 1e3], ["N", 1, 0]],
  "N m": [["kN m", 1e-3, 1e3], ["N m", 1, 0]],
  1: [["%", 100, 0]],
};

/** Units in which numbers of a model are typed; others are typed as the file has them. */
const TYPED = {
  m: () => ["mm", 1e3],
  rad: () => ["°", 180 / Math.PI],
  deg: () => ["°", 1],
  Pa: (size) => (size >= 1e8 ? ["GPa", 1e-9] : ["bar", 1e-5]),
};

/** Unit and factor in which people read a quantity of this size. */
export function reading(unit, size) {
  const [name, factor] = (READ[unit] ?? []).find(([, , least]) => Math.abs(size) >= least) ?? [unit, 1];
  return {unit: name, factor};
}

/** Unit and factor in which people type a number of a model. */
export function typing(unit, value) {
  const size = Math.abs(value);
  const [name, factor] = TYPED[unit]?.(size) ?? (/^N\b/.test(unit) ? newtons(unit, size) : [unit === "1" ? "" : prettyUnit(unit), 1]);
  return {unit: name, factor};
}

/** Forces, stiffnesses and dampings are typed in kN and MN where they are large. */
function newtons(unit, size) {
  const [prefix, factor] = size >= 1e6 ? ["M", 1e-6] : size >= 1e4 ? ["k", 1e-3] : ["", 1];
  return [prefix + prettyUnit(unit), factor];
}

/** A number with significant digits; a dash for nothing. */
export function number(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (!Number.isFinite(value)) return String(value);
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  const text = size >= -4 && size < 6 ? value.toFixed(Math.max(0, digits - 1 - size)) : value.toExponential(digits - 1);
  return written(text);
}

/** A number of up to so many digits, without zeros that say nothing: for axes. */
export function plain(value, digits = 4) {
  return written(String(Number(value.toPrecision(digits))));
}

/** A value in SI with the unit people read it in: `0.0123, "m"` is `12.3 mm`. */
export function quantity(value, unit, digits = 3) {
  if (value === null || value === undefined) return "–";
  const {unit: name, factor} = reading(unit, value || 1);
  const told = withUnit(number(value * factor, digits), name);
  // Pressures are absolute: one below zero is none.
  return unit === "Pa" && value < 0 ? `${told} (${t("units.tension")})` : told;
}

/** A number and its unit, as they are written together. */
export function withUnit(text, unit) {
  if (!unit || unit === "1") return text;
  return unit === "°" ? `${text}°` : `${text}\u00a0${unit}`;
}

/** A share of 1 in words. */
export const percentWords = (share) => `${Math.floor(100 * share)}\u00a0%`;

/** What is typed, from what is stored; twelve digits hide that 1.94 times 1000 is not quite 1940. */
export function shown(value, factor) {
  return Number((value * factor).toPrecision(12));
}

/** What is stored, from what is typed. */
export function stored(value, factor) {
  return Number((value / factor).toPrecision(12));
}

/** `N*m*s/rad` as `N·m·s/rad`, `m/s^2` as `m/s²`. */
export function prettyUnit(unit) {
  return unit.replace(/\*/g, "·").replace(/\^2/g, "²").replace(/\^3/g, "³");
}

/** A moment as this language writes it. */
export function moment(text, language) {
  if (!text) return "–";
  const date = new Date(typeof text === "number" ? text * 1000 : text);
  const today = date.toDateString() === new Date().toDateString();
  const options = today ? {hour: "2-digit", minute: "2-digit", second: "2-digit"} : {dateStyle: "short", timeStyle: "short"};
  return new Intl.DateTimeFormat(language === "vi" ? "vi" : "en-GB", options).format(date);
}
