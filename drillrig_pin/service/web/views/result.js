// A finished run: verdict, numbers against their limits, trust, the moving machine, figures, files.

import {fileOf} from "../api.js";
import {h, table} from "../dom.js";
import {t} from "../i18n.js";
import {quantityLabel} from "../labels.js";
import {cards, kindLabel} from "../parts.js";
import {byKey, levelOf} from "../records.js";
import {number, quantity} from "../units.js";

/** Everything about a finished run. */
export function result(record, found, drawn) {
  const numbers = byKey(found.quantities);
  return [verdict(record, found, numbers), found.samples >= 2 ? animation(record) : null, details(found), figures(record, drawn), files(record, found)];
}

function verdict(record, found, numbers) {
  const level = found.verdict ? levelOf(found.verdict.level) : "bad";
  const told = noteworthy(found);
  const silent = level === "bad" && !told.length;
  return h("section", {"aria-labelledby": "verdict-title"},
    h("h2", {id: "verdict-title"}, t("result.verdict")),
    h("p", {class: `headline ${level}`}, t(`headline.${headlineOf(found, level)}`)),
    told.length ? h("ul", {class: "watch"}, told.map(({level: its, words}) => h("li", {}, h("span", {class: `badge ${its}`}, t(`level.${its}`)), words))) : null,
    cards(keyNumbers(numbers)),
    trust(found, numbers),
    found.findings.length ? h("details", {open: silent}, h("summary", {}, t("result.findings", {n: found.findings.length})), h("ul", {class: "findings", lang: "en"}, found.findings.map(finding))) : null);
}

/** Which sentence the whole comes to, as in the report: invalid before bad before not steady before near a limit. */
function headlineOf(found, level) {
  if (found.valid === false) return "invalid";
  return level === "near" && found.steadiness?.steady === false ? "unsteady" : level;
}

/** What is near or over a limit, or went wrong, in the reader's words. */
function noteworthy(found) {
  const early = found.outcome.completed ? [] : [{level: "bad", words: t("result.stopped", {time: number(found.outcome.time, 3), cause: found.outcome.cause || found.outcome.name})}];
  const { valid_until: from, doubt } = found.outcome;
  if (from !== null && from !== undefined) early.push({level: "bad", words: t("result.invalid", {time: number(from, 4), cause: doubt})});
  const lifted = found.quantities.filter((row) => row.key.endsWith(".tension") && row.value > 0).map((row) => ({level: "bad", words: `${quantityLabel(row.key, row.label)}: ${quantity(row.value, row.unit)}`}));
  const judged = found.quantities.filter((row) => ["near", "bad"].includes(row.verdict && levelOf(row.verdict))).map((row) => ({level: levelOf(row.verdict), words: `${quantityLabel(row.key, row.label)}: ${quantity(row.value, row.unit)} (${limitWords(row)})`}));
  return [...early, ...lifted, ...judged].sort((a, b) => (a.level > b.level) - (a.level < b.level));
}

function finding(item) {
  const level = levelOf(item.level);
  return h("li", {}, h("span", {class: `badge ${level}`}, t(`level.${level}`)),
    h("div", {}, h("strong", {}, `${item.title}.`), " ", item.sentence, item.advice ? [h("br"), h("span", {class: "advice"}, item.advice)] : null));
}

/** The numbers a designer looks at first, by what the run has. */
export function keyNumbers(numbers) {
  const all = Object.values(numbers);
  const largest = (pattern, least = false) => all.filter((row) => pattern.test(row.key)).sort((a, b) => (least ? a.value - b.value : b.value - a.value))[0];
  const chosen = [largest(/^hole\.angle\.worst$/), largest(/^hole\.toe_6m\.worst$/) ?? largest(/^hole\.toe_.*\.worst$/), largest(/\.across\.rms$/), largest(/\.peak_to_peak$/), numbers["frequency.strongest"], largest(/\.p_max$/), largest(/\.p_min$/, true), largest(/\.tension$/)];
  return [...new Set(chosen.filter(Boolean))].map((row) => ({label: quantityLabel(row.key, row.label), value: quantity(row.value, row.unit), note: limitWords(row)}));
}

function limitWords(row) {
  if (row.limit === null || row.limit === undefined) return "";
  const words = t(row.better === "higher" ? "result.limit_low" : "result.limit", {value: quantity(row.limit, row.unit)});
  return row.limit_assumed ? `${words} (${t("field.assumed")})` : words;
}

function trust(found, numbers) {
  const rows = [];
  const error = numbers["trust.error"], energy = numbers["trust.energy"];
  if (error) rows.push(t("result.error", {value: error.value.toExponential(1)}));
  if (energy) rows.push(t("result.energy", {value: energy.value.toExponential(1)}));
  rows.push(t("result.computed", {engine: found.method, time: number(found.cost.wall_time, 2), steps: found.outcome.steps}));
  return h("div", {},
    h("p", {class: "aside"}, h("strong", {}, t("result.trust")), ": ", rows.join("; "), "."),
    found.parameters ? h("p", {class: "aside"}, t("result.assumed", {n: found.assumed, of: found.parameters})) : null,
    [...(found.warnings ?? []), ...(found.notes ?? [])].map((text) => h("p", {class: "notice", lang: "en"}, text)));
}

function animation(record) {
  return h("section", {"aria-labelledby": "animation-title"},
    h("h2", {id: "animation-title"}, t("result.animation")),
    h("p", {class: "aside"}, t("result.animation_help")),
    h("iframe", {src: fileOf(record.id, "replay"), title: t("result.animation"), sandbox: "allow-scripts"}),
    h("p", {class: "aside"}, h("a", {href: fileOf(record.id, "replay"), target: "_blank", rel: "noopener"}, t("result.alone"))));
}

function details(found) {
  const groups = [...new Set(found.quantities.map((row) => row.group))].filter((group) => group !== "cost");
  return h("section", {"aria-labelledby": "numbers-title"},
    h("h2", {id: "numbers-title"}, t("result.numbers")),
    h("div", {class: "columns"}, groups.map((group) => groupTable(group, found.quantities.filter((row) => row.group === group)))),
    h("p", {class: "aside"}, t("result.units")));
}

function groupTable(group, rows) {
  const limited = rows.some((row) => row.limit !== null && row.limit !== undefined);
  const heads = [kindLabel(group), t("result.value"), ...(limited ? [t("result.limit_head"), ""] : [])];
  const lines = rows.map((row) => ({
    class: row.verdict && levelOf(row.verdict) === "bad" ? "over" : "",
    cells: [quantityLabel(row.key, row.label), quantity(row.value, row.unit), ...(limited ? [row.limit == null ? "" : quantity(row.limit, row.unit), row.verdict ? h("span", {class: `badge ${levelOf(row.verdict)}`}, t(`level.${levelOf(row.verdict)}`)) : ""] : [])],
  }));
  return h("div", {}, table(heads, lines, {label: kindLabel(group)}));
}

function figures(record, all) {
  if (!all.length) return null;
  const drawn = all.map((figure) => h("figure", {}, h("img", {src: figure.svg.slice(1), alt: figure.title, loading: "lazy"}), h("figcaption", {lang: "en"}, figure.caption ?? figure.title)));
  return h("section", {"aria-labelledby": "figures-title"}, h("h2", {id: "figures-title"}, t("result.figures")),
    h("p", {class: "aside"}, h("a", {href: fileOf(record.id, "report"), target: "_blank", rel: "noopener"}, t("result.report_figures"))),
    h("div", {class: "figures"}, drawn));
}

function files(record, found) {
  const formats = [["nc", "NetCDF"], ["csv", "CSV"], ["mat", "MATLAB"]];
  const links = formats.map(([format, name]) => h("a", {class: "button", href: fileOf(record.id, "result", {format}), download: true}, name));
  return h("section", {"aria-labelledby": "files-title"}, h("h2", {id: "files-title"}, t("result.files")),
    h("div", {class: "actions"}, h("a", {class: "button", href: fileOf(record.id, "report"), target: "_blank", rel: "noopener"}, t("result.report")), links),
    found.command ? [h("h3", {}, t("result.command")), h("pre", {tabindex: "0"}, h("code", {}, found.command))] : null,
    h("p", {class: "aside"}, t("result.hash"), " ", h("code", {}, found.content_hash)));
}
