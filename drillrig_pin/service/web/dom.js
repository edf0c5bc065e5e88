// Elements in one expression. Text always becomes a text node: nothing that comes from a model is read as HTML.

const SVG = "http://www.w3.org/2000/svg";

/** An HTML element: `h("button", {class: "main", onclick: run}, "Run")`; null and false children are left out. */
export function h(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** The same for SVG. */
export function s(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "indeterminate") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** A fresh id, so that a label finds its input. */
let count = 0;
export function freshId(name = "e") {
  count += 1;
  return `${name}-${count}`;
}

/** Say something to those who listen to the page instead of looking at it. */
export function announce(text) {
  document.getElementById("live").textContent = text;
}

/** Calls that come faster than this many milliseconds become one. */
export function settled(action, milliseconds = 200) {
  let timer = 0;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => action(...given), milliseconds);
  };
}

/** A table from heads and rows of cells; the first cell of a row is its head. */
export function table(heads, rows, attributes = {}) {
  const head = h("tr", {}, heads.map((cell) => (cell instanceof HTMLTableCellElement ? cell : h("th", {scope: "col"}, cell))));
  const body = rows.map((row) => {
    const [first, ...rest] = row.cells ?? row;
    return h("tr", {class: row.class}, h("th", {scope: "row"}, first), rest.map((cell) => cell instanceof HTMLTableCellElement ? cell : h("td", {}, cell)));
  });
  return h("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": attributes.label}, h("table", {class: attributes.class}, h("thead", {}, head), h("tbody", {}, body)));
}
