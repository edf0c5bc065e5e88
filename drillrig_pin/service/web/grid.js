// The table of a study as the page draws it: columns with the units people read, and rows found by their place in the grid.

import {axisLabel} from "./labels.js";
import {reading, typing} from "./units.js";

const SAME = 1e-9;

/** Read a table: `axes` are varied, `metrics` were measured, `rows` are objects by column. */
export function tableOf(table, study, parameterUnits) {
  const rows = table.rows.map((row) => Object.fromEntries(table.columns.map((name, i) => [name, row[i]])));
  const largest = (name) => Math.max(0, ...rows.map((row) => Math.abs(row[name])).filter(Number.isFinite));
  return {
    rows,
    planned: Object.fromEntries((study.axes ?? []).filter((axis) => axis.range?.count).map((axis) => [axis.name, spaced(axis.range)])),
    axes: table.inputs.map((name) => ({name, scale: typing(parameterUnits[axisLabel(name)] ?? table.units[name] ?? "", largest(name))})),
    metrics: table.metrics.map((name) => ({name, scale: reading(table.units[name] ?? "", largest(name))})),
  };
}

/** The values of each varied number in order, if the cases fill a line or a rectangle; nothing otherwise. */
export function gridOf(found) {
  if (found.axes.length < 1 || found.axes.length > 2) return null;
  const grid = found.axes.map(({name, scale}) => {
    const raw = found.planned[name] ?? [...new Set(found.rows.map((row) => row[name]).filter((value) => typeof value === "number"))].sort((a, b) => a - b);
    return {name, label: axisLabel(name), unit: scale.unit, raw, values: raw.map((value) => value * scale.factor), log: even(raw.map(Math.log)) && !even(raw)};
  });
  const cells = grid.reduce((product, axis) => product * axis.raw.length, 1);
  // A sample that fills no rectangle would be a picture of holes.
  const whole = found.axes.every(({name}) => name in found.planned);
  return cells && (whole || cells <= 2 * found.rows.length + 4) ? grid : null;
}

/** The row at a place of the grid; nothing if it is not computed yet. */
export function rowAt(found, grid, place) {
  return found.rows.find((row) => grid.every((axis, i) => near(row[axis.name], axis.raw[place[i]]))) ?? null;
}

/** The values of a range, as the service spaces them. */
function spaced({start, stop, count, scale}) {
  const at = (share) => (scale === "log" ? start * (stop / start) ** share : start + share * (stop - start));
  return Array.from({length: count}, (_, i) => at(count > 1 ? i / (count - 1) : 0));
}

const near = (a, b) => Math.abs(a - b) <= SAME * Math.max(Math.abs(a), Math.abs(b));

/** Whether numbers are evenly spaced. */
function even(values) {
  if (values.length < 3 || values.some((value) => !Number.isFinite(value))) return true;
  const steps = values.slice(1).map((value, i) => value - values[i]);
  return Math.max(...steps) - Math.min(...steps) < 1e-6 * Math.abs(values.at(-1) - values[0]);
}
