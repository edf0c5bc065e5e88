// One sweep: progress while it runs, and what came out so far as a curve or a heat map whose points open their cases.

import {cancelStudy, deleteStudy, fileOfStudy, study, studyTable, submitRun} from "../api.js";
import {curve} from "../curve.js";
import {h, table} from "../dom.js";
import {heatMap, labelled} from "../heatmap.js";
import {currentLanguage, t} from "../i18n.js";
import {axisLabel, quantityLabel} from "../labels.js";
import {carefulButton, ended, metricChoice, notice, statusBadge} from "../parts.js";
import {go} from "../router.js";
import {gridOf, rowAt, tableOf} from "../grid.js";
import {merged} from "../form/request.js";
import {unitsOf} from "../form/sources.js";
import {moment, number, plain, withUnit} from "../units.js";
import {watched} from "./job.js";

/** Between having the rows there are and asking for more [ms]. */
const PAUSE = 1500;

/** The view of a study. */
export async function studyView(context, id) {
  const record = await study(id);
  const shown = new Outcome(record);
  const job = h("div");
  const head = h("div", {class: "top"}, h("div", {}, h("h1", {}, record.name), h("p", {class: "facts"}, facts(record).join(" · "))), h("div", {class: "actions"}));
  const finish = (last) => {
    shown.record = last;
    job.replaceChildren(last.error ? notice(last.error) : last.status === "completed" ? "" : h("p", {}, statusBadge(last)));
    head.lastChild.replaceChildren(...ways(last));
    return shown.load();
  };
  if (ended(record)) await finish(record);
  else {
    let asking = false;
    const news = async () => {
      if (asking) return;
      asking = true;
      await shown.load().catch(() => {});
      setTimeout(() => { asking = false; }, PAUSE);
    };
    const words = (now, share) => t("study.share", {done: Math.round((share ?? 0) * now.cases), total: now.cases});
    job.append(watched(context, {record, events: fileOfStudy(id, "events"), ask: () => study(id), cancel: () => cancelStudy(id), words, heard: news}, (last) => finish(last).catch(() => {})));
  }
  return [head, job, shown.node];
}

function facts(record) {
  const {scenario, set} = record.study;
  const changes = Object.entries(set ?? {}).map(([name, value]) => `${axisLabel(name)} = ${value}`);
  const length = scenario?.duration ? withUnit(plain(scenario.duration), "s") : null;
  return [record.model, scenario?.name ?? scenario, length, ...changes, moment(record.created, currentLanguage())].filter((word) => typeof word === "string");
}

function ways(record) {
  const remove = carefulButton(t("run.delete"), t("run.delete_sure"), async () => { await deleteStudy(record.id); go("/studies"); });
  const files = record.status === "completed" ? [h("a", {class: "button", href: fileOfStudy(record.id, "report"), target: "_blank", rel: "noopener"}, t("result.report")), h("a", {class: "button", href: fileOfStudy(record.id, "table", {format: "csv"}), download: true}, "CSV"), h("a", {class: "button", href: fileOfStudy(record.id, "table", {format: "parquet"}), download: true}, "Parquet")] : [];
  return [...files, remove];
}

/** What a study has found, drawn by the metric the reader chose. */
/** Whether a case has a number that may be drawn and ranked: it reached its end and is valid. */
const usable = (row, column) => row.status === "completed" && row[column.name] !== null;

class Outcome {
  constructor(record) {
    this.record = record;
    this.metric = null;
    this.asked = 0;
    this.trouble = h("div");
    this.node = h("div");
  }

  async load() {
    this.asked += 1;
    const mine = this.asked;
    const [table, units] = await Promise.all([studyTable(this.record.id), unitsOf(this.record.model)]);
    // An answer that was asked for earlier may come later.
    if (mine !== this.asked) return;
    this.found = tableOf(table, this.record.study, units);
    this.draw();
  }

  draw() {
    const {found} = this;
    const {metrics} = found;
    const names = found.axes.map(({name}) => name);
    if (!metrics.length) {
      this.node.replaceChildren(found.rows.length ? this.cases(metrics, names) : "");
      return;
    }
    this.metric = metrics.some((column) => column.name === this.metric) ? this.metric : metrics[0].name;
    const column = metrics.find(({name}) => name === this.metric);
    const choice = h("label", {}, h("span", {}, t("study.metric")), metricChoice(metrics.map(({name}) => name), this.metric, (name) => { this.metric = name; this.draw(); }));
    const held = document.activeElement?.tagName === "SELECT" && this.node.contains(document.activeElement);
    this.node.replaceChildren(this.trouble,
      h("section", {}, h("div", {class: "filter"}, choice), this.picture(column, names), h("p", {class: "aside"}, t("study.open")), this.extremes(column, names)),
      this.cases(metrics, names));
    if (held) this.node.querySelector("select").focus();
  }

  picture(column, names) {
    const grid = gridOf(this.found);
    if (!grid) return h("p", {class: "aside"}, t("study.no_picture"));
    const scale = column.scale;
    const point = (row) => row && {value: !usable(row, column) ? NaN : row[column.name] * scale.factor, short: number(row[column.name] * scale.factor, 3), words: this.words(row, column, names), open: () => this.open(row)};
    const title = quantityLabel(column.name);
    if (grid.length === 1) return curve({x: grid[0], y: {label: title, unit: scale.unit}, points: (i) => point(rowAt(this.found, grid, [i]))});
    return heatMap({x: grid[0], y: grid[1], title: labelled({label: title, unit: scale.unit}), unit: scale.unit, cells: (i, j) => point(rowAt(this.found, grid, [i, j]))});
  }

  words(row, column, names) {
    const place = names.map((name) => `${axisLabel(name)} = ${this.shownAxis(name, row[name])}`).join(", ");
    if (!usable(row, column)) return `${place}: ${row.reason || row.status}`;
    return `${place}: ${withUnit(number(row[column.name] * column.scale.factor, 4), column.scale.unit)}`;
  }

  shownAxis(name, value) {
    const axis = this.found.axes.find((column) => column.name === name);
    return axis && typeof value === "number" ? withUnit(plain(value * axis.scale.factor), axis.scale.unit) : String(value);
  }

  extremes(column, names) {
    const rows = this.found.rows.filter((row) => usable(row, column)).sort((a, b) => a[column.name] - b[column.name]);
    if (!rows.length) return null;
    const line = (label, row) => h("p", {}, h("strong", {}, label), " ", this.words(row, column, names), " ", h("button", {type: "button", class: "link", onclick: () => this.open(row)}, t("study.open_case")));
    return h("div", {}, line(t("study.least"), rows[0]), line(t("study.most"), rows.at(-1)));
  }

  cases(metrics, names) {
    const some = metrics.slice(0, 6);
    const lines = this.found.rows.map((row) => [
      ...names.map((name, i) => (i ? h("td", {}, this.shownAxis(name, row[name])) : this.shownAxis(name, row[name]))),
      ...some.map((column) => (!usable(row, column) ? "–" : withUnit(number(row[column.name] * column.scale.factor, 4), column.scale.unit))),
      h("td", {class: "words", lang: "en"}, row.status === "completed" ? h("button", {type: "button", class: "link", onclick: () => this.open(row)}, t("study.open_case")) : row.reason || row.status),
    ]);
    return h("section", {}, h("details", {}, h("summary", {}, t("study.cases", {n: this.found.rows.length})), table([...names.map(axisLabel), ...some.map(({name}) => quantityLabel(name)), ""], lines, {label: t("study.cases", {n: this.found.rows.length})})));
  }

  request(row) {
    const {model, scenario, set} = this.record.study;
    const changes = {...set, ...Object.fromEntries(this.found.axes.map(({name}) => [name, row[name]]))};
    const part = (kind) => Object.fromEntries(Object.entries(changes).filter(([name]) => name.startsWith(`${kind}.`)).map(([name, value]) => [name.slice(kind.length + 1), value]));
    return {model, arguments: part("model"), scenario: merged(scenario, part("scenario"))};
  }

  /** A case is a run like any other: asked for, it is computed in a moment or there already. */
  async open(row) {
    try {
      const run = await submitRun(this.request(row));
      go(`/runs/${run.id}`);
    } catch (problem) {
      this.trouble.replaceChildren(notice(problem));
    }
  }
}
