// One axis of a sweep: which number of the model, from where to where, in how many steps.

import {freshId, h} from "../dom.js";
import {t} from "../i18n.js";
import {shown, stored, typing} from "../units.js";
import {outside, parsed, typed} from "./numbers.js";

const SPREAD = 0.1;
const COUNT = 5;
/** A sweep of the page is for looking at; larger ones are for scripts. */
const MOST = 60;

/** The inputs of one axis. `optional`: it may stay empty. */
export class Axis {
  constructor(number, parameters, optional, onchange) {
    this.parameters = parameters;
    this.optional = optional;
    this.onchange = onchange;
    this.list = freshId("names");
    const input = (attributes) => h("input", {type: "text", autocomplete: "off", oninput: () => this.heard(), ...attributes});
    this.name = input({list: this.list, onchange: () => this.choose(), oninput: () => this.choose(), placeholder: t(optional ? "sweep.none" : "sweep.name_hint"), spellcheck: "false"});
    this.start = input({inputmode: "decimal"});
    this.stop = input({inputmode: "decimal"});
    this.count = input({inputmode: "numeric", value: COUNT});
    this.scale = h("select", {onchange: () => this.heard()}, h("option", {value: "linear"}, t("sweep.linear")), h("option", {value: "log"}, t("sweep.log")));
    this.unit = [h("span", {class: "unit"}), h("span", {class: "unit"})];
    this.help = h("p", {class: "aside axis-help", lang: "en"});
    this.trouble = h("p", {class: "trouble worse", role: "alert", hidden: true});
    const labelled = (label, node, unit) => h("label", {}, h("span", {}, label, unit ? [" ", unit] : null), node);
    this.node = h("fieldset", {"data-axis": number},
      h("legend", {}, h("h3", {}, t(number === 1 ? "sweep.first" : "sweep.second"))),
      h("datalist", {id: this.list}, parameters.map((row) => h("option", {value: row.name}, row.text))),
      h("div", {class: "axis"}, labelled(t("sweep.parameter"), this.name), labelled(t("sweep.start"), this.start, this.unit[0]), labelled(t("sweep.stop"), this.stop, this.unit[1]), labelled(t("sweep.count"), this.count), labelled(t("sweep.scale"), this.scale)),
      this.help, this.trouble);
    this.choose();
  }

  /** The chosen parameter; nothing while there is none. */
  get row() {
    return this.parameters.find((row) => row.name === this.name.value.trim()) ?? null;
  }

  /** How many values; 1 for an axis that is left empty. */
  get length() {
    return this.row ? Number(this.count.value) || 0 : 1;
  }

  /** The axis as a study has it. */
  get value() {
    const {factor} = this.units;
    const ends = {start: stored(parsed(this.start.value), factor), stop: stored(parsed(this.stop.value), factor)};
    return {name: `model.${this.row.name}`, range: {...ends, count: this.length, scale: this.scale.value}};
  }

  /** Take a parameter by name, as if it had been typed. */
  take(name) {
    this.name.value = name;
    this.choose();
  }

  /** Propose a range around the number in force. */
  choose() {
    const {row} = this;
    if (row !== this.known) {
      this.known = row;
      for (const input of [this.start, this.stop, this.count, this.scale]) input.disabled = !row;
      this.units = row ? typing(row.unit, Number(row.value)) : {unit: "", factor: 1};
      for (const unit of this.unit) unit.textContent = this.units.unit ? `[${this.units.unit}]` : "";
      if (row) this.propose(row);
    }
    this.help.textContent = row ? `${row.text} (${typed(shown(Number(row.value), this.units.factor))} ${this.units.unit}, ${row.source})` : "";
    this.heard();
  }

  propose(row) {
    const value = Number(row.value), by = Math.abs(value) * SPREAD || 1 / this.units.factor;
    const within = (end) => Math.min(row.high ?? end, Math.max(row.low ?? end, end));
    const round = (end) => typed(Number(shown(within(end), this.units.factor).toPrecision(3)));
    this.start.value = round(value - by);
    this.stop.value = round(value + by);
  }

  /** What is wrong with it, in words; nothing if it may be sent. */
  check() {
    const text = this.problem();
    this.trouble.textContent = text;
    this.trouble.hidden = !text;
    this.name.setAttribute("aria-invalid", String(Boolean(text)));
    return !text;
  }

  problem() {
    if (!this.row) return this.name.value.trim() ? t("sweep.no_such", {name: this.name.value.trim()}) : this.optional ? "" : t("sweep.choose");
    const ends = [parsed(this.start.value), parsed(this.stop.value)];
    if (ends.some(Number.isNaN)) return t("field.no_number");
    if (ends[0] >= ends[1]) return t("sweep.order");
    if (!Number.isInteger(this.length) || this.length < 2 || this.length > MOST) return t("sweep.count_range", {most: MOST});
    if (this.scale.value === "log" && ends[0] <= 0) return t("sweep.log_positive");
    const range = {low: this.row.low ?? null, high: this.row.high ?? null};
    for (const end of ["low", "high"]) if (range[end] !== null) range[end] = shown(range[end], this.units.factor);
    return ends.map((end) => outside(end, range, this.units.unit)).find(Boolean) ?? "";
  }

  heard() {
    if (!this.trouble.hidden) this.check();
    this.onchange();
  }
}

/** Numbers that can be swept; words cannot. */
export const sweepable = (parameters) => parameters.filter((row) => row.value !== "" && !Number.isNaN(Number(row.value)));

