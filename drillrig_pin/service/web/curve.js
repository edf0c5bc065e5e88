// A metric over one parameter as a line with a point for every case, each a way into it.

import {s} from "./dom.js";
import {labelled} from "./heatmap.js";
import {plain} from "./units.js";
import {stop, walkable} from "./walk.js";

const LEFT = 84, TOP = 18, RIGHT = 24, BOTTOM = 60;
const WIDTH = 860;
const HEIGHT = 400;

/** Round steps that divide a range into about `count` parts. */
export function ticks(low, high, count = 6) {
  if (!(high > low)) return [low];
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) found.push(Number((k * step).toPrecision(12)));
  return found;
}

/**
 * The picture.
 *
 * @param x      {label, unit, values, log}: what is varied, as people read it
 * @param y      {label, unit}: what is measured
 * @param points (index) => {value, words, open} or null where there is no row yet
 */
export function curve({x, y, points}) {
  const all = x.values.map((value, i) => ({at: value, point: points(i)}));
  const known = all.filter(({point}) => point && Number.isFinite(point.value));
  const values = known.map(({point}) => point.value);
  const spread = Math.max(...values) - Math.min(...values) || Math.abs(values[0]) || 1;
  const low = Math.min(...values) - 0.06 * spread, high = Math.max(...values) + 0.06 * spread;
  const scale = x.log ? Math.log : (value) => value;
  const ends = [Math.min(...x.values), Math.max(...x.values)];
  const across = (value) => LEFT + ((WIDTH - LEFT - RIGHT) * (scale(value) - scale(ends[0]))) / (scale(ends[1]) - scale(ends[0]) || 1);
  const up = (value) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * (value - low)) / (high - low);
  const frame = s("rect", {class: "frame", x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM});
  const marks = x.log || x.values.length <= 8 ? x.values : ticks(...ends, 8);
  return walkable(s("svg", {class: "chart", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": labelled(y)},
    values.length ? ticks(low, high).map((value) => [
      s("line", {class: "grid", x1: LEFT, x2: WIDTH - RIGHT, y1: up(value), y2: up(value)}),
      s("text", {x: LEFT - 8, y: up(value) + 4, "text-anchor": "end"}, plain(value, 3)),
    ]) : null,
    marks.map((value) => s("text", {x: across(value), y: HEIGHT - BOTTOM + 18, "text-anchor": "middle"}, plain(value))),
    s("text", {class: "soft", x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - BOTTOM + 44, "text-anchor": "middle"}, labelled(x)),
    s("text", {class: "soft", transform: `translate(16 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)`, "text-anchor": "middle"}, labelled(y)),
    frame,
    s("polyline", {class: "line", points: known.map(({at, point}) => `${across(at)},${up(point.value)}`).join(" ")}),
    known.map(({at, point}, i) => stop([i, 0], point, ...dot(across(at), up(point.value))))));
}

const dot = (x, y) => [s("circle", {cx: x, cy: y, r: 14, fill: "transparent"}), s("circle", {class: "dot cell", cx: x, cy: y, r: 5})];
