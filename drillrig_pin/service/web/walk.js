// Points of a chart that open something: one stop of the tabulator for all of them, arrow keys from one to the next.

import {s} from "./dom.js";

const STEPS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};

/**
 * A point of a chart.
 *
 * @param place [column, row], rows counted upwards
 * @param point {words, open}
 */
export function stop(place, point, ...shapes) {
  const open = (event) => {
    event.preventDefault();
    point.open();
  };
  const press = (event) => (event.key === "Enter" || event.key === " ") && open(event);
  return s("a", {href: "#", role: "button", tabindex: "-1", "data-place": place.join(), "aria-label": point.words, onclick: open, onkeydown: press}, s("title", {}, point.words), ...shapes);
}

/** Let the arrow keys walk over the points of a chart. */
export function walkable(chart) {
  const stops = new Map([...chart.querySelectorAll("[data-place]")].map((node) => [node.dataset.place, node]));
  stops.values().next().value?.setAttribute("tabindex", "0");
  chart.addEventListener("keydown", (event) => {
    const step = STEPS[event.key];
    const here = event.target.closest("[data-place]");
    if (!step || !here) return;
    event.preventDefault();
    const [column, row] = here.dataset.place.split(",").map(Number);
    const next = stops.get([column + step[0], row + step[1]].join());
    if (!next) return;
    here.setAttribute("tabindex", "-1");
    next.setAttribute("tabindex", "0");
    next.focus();
  });
  return chart;
}
