// A metric over two parameters as coloured cells, each a way into its case.

import {s} from "./dom.js";
import {t} from "./i18n.js";
import {number, plain, withUnit} from "./units.js";
import {stop, walkable} from "./walk.js";

const CELL_TEXT = 46;
const LEFT = 96, TOP = 16, RIGHT = 120, BOTTOM = 62;
const WIDTH = 860;
const HEIGHT = 480;

/** Dark to light, even in brightness, and readable by those who see red and green alike. */
const SCALE = [[0, [24, 28, 84]], [0.25, [32, 86, 150]], [0.5, [48, 146, 152]], [0.75, [128, 198, 110]], [1, [250, 228, 84]]];

/** Colour at a share from 0 to 1. */
export function colour(share) {
  const at = Math.min(1, Math.max(0, share));
  const i = Math.max(1, SCALE.findIndex(([stop]) => stop >= at));
  const [low, from] = SCALE[i - 1], [high, to] = SCALE[i];
  const part = (at - low) / (high - low);
  return `rgb(${from.map((value, k) => Math.round(value + part * (to[k] - value))).join(" ")})`;
}

/**
 * The picture.
 *
 * @param x, y  {label, unit, values}: what is varied, as people read it
 * @param cells (column, row) => {value, words, name, open} or null where there is no row yet
 * @param title what the colour says
 * @param unit  of the values
 */
export function heatMap({x, y, cells, title, unit}) {
  const wide = (WIDTH - LEFT - RIGHT) / x.values.length, high = (HEIGHT - TOP - BOTTOM) / y.values.length;
  const all = x.values.flatMap((_, i) => y.values.map((__, j) => cells(i, j)));
  const known = all.filter((cell) => cell && Number.isFinite(cell.value)).map((cell) => cell.value);
  const least = Math.min(...known), most = Math.max(...known);
  const share = (value) => (most > least ? (value - least) / (most - least) : 0.5);
  const nodes = [];
  x.values.forEach((_, i) => y.values.forEach((__, j) => {
    const cell = cells(i, j);
    const place = {x: LEFT + i * wide, y: HEIGHT - BOTTOM - (j + 1) * high, width: wide, height: high};
    nodes.push(drawn(cell, [i, j], place, cell && Number.isFinite(cell.value) ? share(cell.value) : null));
  }));
  return walkable(s("svg", {class: "chart heatmap", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": title},
    nodes, axes(x, y, wide, high), known.length ? key(least, most, unit) : null));
}

function drawn(cell, at, place, share) {
  const shape = s("rect", {...place, class: share === null ? "cell failed" : "cell"});
  if (share !== null) shape.setAttribute("fill", colour(share));
  if (!cell) return shape;
  const readable = place.width > CELL_TEXT && place.height > 18 && share !== null;
  const text = readable ? s("text", {class: "value", x: place.x + place.width / 2, y: place.y + place.height / 2 + 4, "text-anchor": "middle"}, cell.short) : null;
  if (text) text.style.fill = share > 0.55 ? "#111" : "#fff";
  return stop(at, cell, shape, text);
}

function axes(x, y, wide, high) {
  const bottom = HEIGHT - BOTTOM;
  const every = Math.ceil(x.values.length / Math.floor((WIDTH - LEFT - RIGHT) / 58));
  const everyY = Math.ceil(y.values.length / Math.floor((HEIGHT - TOP - BOTTOM) / 20));
  return [
    x.values.map((value, i) => (i % every ? null : s("text", {x: LEFT + (i + 0.5) * wide, y: bottom + 18, "text-anchor": "middle"}, plain(value)))),
    y.values.map((value, j) => (j % everyY ? null : s("text", {x: LEFT - 8, y: bottom - (j + 0.5) * high + 4, "text-anchor": "end"}, plain(value)))),
    s("text", {class: "soft", x: LEFT + (WIDTH - LEFT - RIGHT) / 2, y: bottom + 44, "text-anchor": "middle"}, labelled(x)),
    s("text", {class: "soft", transform: `translate(16 ${(TOP + bottom) / 2}) rotate(-90)`, "text-anchor": "middle"}, labelled(y)),
  ];
}

/** A name with its unit, as it stands at an axis. */
export const labelled = ({label, unit}) => (unit && unit !== "1" ? `${label} [${unit}]` : label);

function key(least, most, unit) {
  const steps = 40, left = WIDTH - RIGHT + 28, height = HEIGHT - TOP - BOTTOM;
  const bars = Array.from({length: steps}, (_, i) => s("rect", {x: left, y: TOP + height * (1 - (i + 1) / steps), width: 18, height: height / steps + 0.5, fill: colour((i + 0.5) / steps)}));
  const words = [[most, TOP + 10], [(least + most) / 2, TOP + height / 2 + 4], [least, TOP + height]];
  return [bars, words.map(([value, y]) => s("text", {x: left + 24, y}, withUnit(number(value, 3), unit))), s("title", {}, t("study.scale"))];
}
