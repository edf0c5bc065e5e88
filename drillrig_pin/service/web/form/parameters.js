// The numbers of a model as a form: in groups, searched by words, only what was changed is sent.

import {h, settled} from "../dom.js";
import {t} from "../i18n.js";
import {groupLabel} from "../labels.js";
import {Field} from "./field.js";

/** The form of a model's parameters. */
export class ParameterForm {
  constructor(parameters, onchange) {
    this.fields = parameters.map((row) => new Field(described(row), onchange));
    this.filter = {words: [], assumed: false, changed: false};
    this.found = h("output", {"aria-live": "polite"});
    this.groups = this.grouped(parameters);
    this.node = h("section", {"aria-labelledby": "parameters-title"},
      h("h2", {id: "parameters-title"}, t("new.numbers")),
      this.tools(),
      this.groups.map((group) => group.node));
    this.narrow();
  }

  /** What was changed, by name. */
  get values() {
    return Object.fromEntries(this.fields.filter((field) => field.changed).map((field) => [field.name, field.value]));
  }

  /** The field of a name. */
  field(name) {
    return this.fields.find((field) => field.name === name);
  }

  grouped(parameters) {
    const names = [...new Set(parameters.map((row) => row.group))];
    return names.map((name) => {
      const fields = this.fields.filter((field, i) => parameters[i].group === name);
      const count = h("span", {class: "count"});
      const node = h("details", {class: "group", open: names.length === 1}, h("summary", {}, groupLabel(name), " ", count), h("div", {class: "fields"}, fields.map((field) => field.node)));
      return {node, fields, count};
    });
  }

  tools() {
    const search = settled(() => this.narrow(true), 120);
    const box = (name, label) => h("label", {class: "check"}, h("input", {type: "checkbox", onchange: (event) => { this.filter[name] = event.target.checked; this.narrow(true); }}), h("span", {}, label));
    return h("div", {class: "filter", role: "search"},
      h("label", {}, h("span", {}, t("new.find")), h("input", {type: "search", autocomplete: "off", placeholder: t("new.find_hint"), oninput: (event) => { this.filter.words = event.target.value.toLowerCase().replace(/_/g, " ").split(" ").filter(Boolean); search(); }, onkeydown: (event) => { if (event.key === "Enter") event.preventDefault(); }})),
      box("assumed", t("new.only_assumed")), box("changed", t("new.only_changed")), this.found);
  }

  /** Show what fits the filter; a filter opens the groups that hold something. */
  narrow(open = false) {
    const {words, assumed, changed} = this.filter;
    const filtered = words.length > 0 || assumed || changed;
    let total = 0;
    for (const group of this.groups) {
      let fitting = 0;
      for (const field of group.fields) {
        const fits = field.matches(words) && (!assumed || field.about.assumed) && (!changed || field.changed);
        field.node.hidden = !fits;
        fitting += fits;
      }
      group.node.hidden = !fitting;
      if (open) group.node.open = (filtered && (words.length > 0 || changed)) || this.groups.length === 1;
      group.count.textContent = `(${fitting})`;
      total += fitting;
    }
    this.found.textContent = t("new.shown", {n: total, of: this.fields.length});
  }
}

/** A row of the model's parameter table as a field. */
export function described(row) {
  if (typeof row.value === "number") return {...row, choices: null, kind: "number"};
  const choices = row.choices.length ? [...new Set([row.value, ...row.choices])] : null;
  return {...row, unit: "", choices, kind: "word"};
}
