// Two runs beside each other: what was not the same, and which numbers changed by how much, the most important first.

import {compare} from "../api.js";
import {h, table} from "../dom.js";
import {t} from "../i18n.js";
import {quantityLabel, typedWords} from "../labels.js";
import {kindLabel} from "../parts.js";
import {query} from "../router.js";
import {number, reading, withUnit} from "../units.js";

const SHOWN = 24;
const SWAP = "\u21c4";

/** The comparison of the runs `a` and `b` of the address. */
export async function compareView() {
  const [a, b] = [query().get("a"), query().get("b")];
  const found = await compare(a, b);
  const names = runNames(found);
  return [
    h("div", {class: "top"},
      h("div", {}, h("h1", {}, t("compare.title")), h("p", {class: "facts"}, h("a", {href: `#/runs/${a}`}, `A: ${names[0]}`), " · ", h("a", {href: `#/runs/${b}`}, `B: ${names[1]}`))),
      h("div", {class: "actions"}, h("a", {class: "button", href: `#/compare?a=${b}&b=${a}`}, `${SWAP} ${t("compare.swap")}`))),
    found.cautions.map((text) => h("p", {class: "notice", lang: "en"}, `${text}.`)),
    h("div", {}, differences(found), changes(found)),
  ];
}

function runNames(found) {
  const parameters = found.differences.filter((row) => row.kind === "parameter").slice(0, 2);
  const name = (i) => parameters.map((row) => `${row.name} = ${valueOf(row, i)}`).join(", ") || found.machines?.[i] || "";
  return [name(0), name(1)];
}

function differences(found) {
  const kinds = ["parameter", "scenario", "software"];
  const main = found.differences.filter((row) => kinds.includes(row.kind));
  const rest = found.differences.filter((row) => !kinds.includes(row.kind));
  const listed = main.some((row) => row.kind === "parameter") ? main : [...main, ...rest];
  const hidden = main.some((row) => row.kind === "parameter") ? rest : [];
  return h("section", {"aria-labelledby": "differences-title"}, h("h2", {id: "differences-title"}, t("compare.differences")),
    listed.length ? differenceTable(listed.slice(0, SHOWN)) : h("p", {}, t("compare.same_question")),
    hidden.length ? h("details", {}, h("summary", {}, t("compare.places", {n: hidden.length})), differenceTable(hidden)) : null);
}

function differenceTable(rows) {
  const lines = rows.map((row) => [row.name, h("td", {class: "words"}, kindLabel(row.kind)), h("td", {class: "words"}, valueOf(row, 0)), h("td", {class: "words"}, valueOf(row, 1))]);
  return table([t("compare.what"), ...[t("compare.kind"), "A", "B"].map(wordsHead)], lines, {label: t("compare.differences")});
}

/** A value of one run; numbers of the model in the unit people read. */
function valueOf(row, i) {
  const value = row.values[i];
  if (value === null) return "–";
  return row.unit && value.trim() && !Number.isNaN(Number(value)) ? typedWords(Number(value), row.unit) : value;
}

const wordsHead = (text) => h("th", {scope: "col", class: "words"}, text);

function changes(found) {
  const changed = found.changes.filter((row) => row.runs[0].verdict !== "same");
  const same = found.changes.length - changed.length;
  const more = changed.slice(SHOWN);
  return h("section", {"aria-labelledby": "changes-title"}, h("h2", {id: "changes-title"}, t("compare.changes")),
    changed.length ? changeTable(changed.slice(0, SHOWN)) : h("p", {}, t("compare.no_change")),
    more.length ? h("details", {}, h("summary", {}, t("compare.more", {n: more.length})), changeTable(more)) : null,
    same ? h("p", {class: "aside"}, t("compare.same", {n: same})) : null);
}

function changeTable(rows) {
  const lines = rows.map((row) => {
    const change = row.runs[0];
    const {unit, factor} = reading(row.unit, Math.max(Math.abs(row.reference), Math.abs(change.value)));
    const sign = change.absolute > 0 ? "+" : "";
    const relative = change.relative === null ? t("compare.from_zero") : withUnit(`${sign}${number(100 * change.relative, 3)}`, "%");
    const verdict = change.verdict === "other" ? "" : h("span", {class: change.verdict}, `${arrow(change)} ${t(`compare.${change.verdict}`)}`);
    return [quantityLabel(row.key, row.label), h("td", {class: "words less"}, kindLabel(row.group)), withUnit(number(row.reference * factor), unit), withUnit(number(change.value * factor), unit), `${sign}${number(change.absolute * factor, 3)}`, relative, h("td", {class: "verdict"}, verdict)];
  });
  return table([t("compare.number"), h("th", {scope: "col", class: "words less"}, t("compare.group")), "A", "B", t("compare.change"), "%", ""], lines, {label: t("compare.changes")});
}

const arrow = (change) => (change.absolute > 0 ? "▲" : "▼");
