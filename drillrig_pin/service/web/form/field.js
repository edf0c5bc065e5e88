// One field of a form: what it is called, means and takes, where its number comes from, and the way back to its default.

import {freshId, h} from "../dom.js";
import {t} from "../i18n.js";
import {outside, parsed, rangeWords, typed} from "./numbers.js";
import {shown, stored, typing} from "../units.js";

/**
 * A field.
 *
 * @param about {name, label, text, unit, value, kind, choices, words, low, high, lowExcluded, source, assumed}; `value`, `low`
 *              and `high` as the service has them, `kind` one of number, integer, word, switch, text
 * @param onchange is called after every change
 */
export class Field {
  constructor(about, onchange) {
    this.about = about;
    this.name = about.name;
    this.onchange = onchange;
    this.scale = typing(about.kind === "number" ? about.unit ?? "" : "", Number(about.value) || 0);
    this.range = Object.fromEntries(["low", "high"].map((end) => [end, typeof about[end] === "number" ? shown(about[end], this.scale.factor) : null]));
    this.range.lowExcluded = about.lowExcluded ?? false;
    this.id = freshId("field");
    this.input = this.makeInput();
    this.trouble = h("p", {class: "trouble", id: `${this.id}-trouble`, hidden: true});
    this.node = this.arranged();
    this.write(about.value);
  }

  /** The value as the service takes it. */
  get value() {
    if (this.about.kind === "switch") return this.input.checked;
    const text = this.input.value;
    if (this.about.words?.includes(text.trim())) return text.trim();
    if (this.about.kind === "number" || this.about.kind === "integer") {
      const number = parsed(text);
      return Number.isNaN(number) ? text : stored(number, this.scale.factor);
    }
    return text;
  }

  /** Whether it differs from the default. */
  get changed() {
    return String(this.value) !== String(this.usual);
  }

  get usual() {
    const {kind, value} = this.about;
    // What is shown has twelve digits; one that has more is not changed for that.
    return kind === "number" && typeof value === "number" ? stored(shown(value, this.scale.factor), this.scale.factor) : value ?? "";
  }

  /** Value and unit as people read them, for a summary. */
  get words() {
    return `${this.input.value}${this.scale.unit && this.scale.unit !== "°" ? " " : ""}${this.scale.unit}`;
  }

  /** Put in a value as the service has it. */
  write(value) {
    const {kind} = this.about;
    if (kind === "switch") this.input.checked = value === true;
    else if (kind === "number" && typeof value === "number") this.input.value = typed(shown(value, this.scale.factor));
    else this.input.value = value ?? "";
    this.update();
  }

  /** Put in a value of an earlier request, which may be a dictionary, a list or nothing. */
  take(value) {
    if (Array.isArray(value)) return this.write(value.join(" "));
    const pairs = value !== null && typeof value === "object";
    this.write(pairs ? Object.entries(value).map(([name, number]) => `${name} = ${number}`).join(", ") : value);
  }

  reset() {
    this.write(this.about.value);
    this.say("");
  }

  /** Check what is typed; true if it may be sent. */
  check() {
    this.say(this.changed ? this.problem() : "");
    return this.trouble.hidden;
  }

  /** Say what is wrong with it; nothing if the text is empty. */
  say(text, language = null) {
    this.trouble.textContent = text;
    this.trouble.hidden = !text;
    if (language) this.trouble.lang = language;
    else this.trouble.removeAttribute("lang");
    this.input.setAttribute("aria-invalid", String(Boolean(text)));
  }

  /** Bring it into sight and put the cursor there. */
  focus() {
    for (let up = this.node.parentElement; up; up = up.parentElement) if (up.tagName === "DETAILS") up.open = true;
    this.node.hidden = false;
    this.input.focus();
    this.node.scrollIntoView({block: "center"});
  }

  /** Whether all words of a search occur in it. */
  matches(words) {
    this.found ??= [this.name, this.about.text, this.about.source, this.about.unit].join(" ").replace(/_/g, " ").toLowerCase();
    return words.every((word) => this.found.includes(word) || this.name.includes(word));
  }

  problem() {
    const {kind, words} = this.about;
    if (kind !== "number" && kind !== "integer") return "";
    if (words?.includes(this.value)) return "";
    if (typeof this.value !== "number") return words?.some(Boolean) ? t("field.no_number_or", {words: words.filter(Boolean).join(", ")}) : t("field.no_number");
    if (kind === "integer" && !Number.isInteger(this.value)) return t("field.no_integer");
    return outside(parsed(this.input.value), this.range, this.scale.unit);
  }

  update() {
    this.node?.classList.toggle("changed", this.changed);
  }

  heard() {
    this.update();
    if (!this.trouble.hidden) this.check();
    this.onchange(this);
  }

  makeInput() {
    const {kind, choices} = this.about;
    const common = {id: this.id, name: this.name, "aria-describedby": `${this.id}-help ${this.id}-trouble`, onchange: () => { this.check(); this.heard(); }, oninput: () => this.heard()};
    if (choices) return h("select", common, choices.map((word) => h("option", {value: word}, word === "" ? t("field.none") : word)));
    if (kind === "switch") return h("input", {...common, type: "checkbox"});
    const numeric = kind === "number" || kind === "integer";
    const name = numeric ? "" : "wide";
    return h("input", {...common, class: name, type: "text", inputmode: numeric && !this.about.words ? "decimal" : null, autocomplete: "off", spellcheck: "false", placeholder: this.about.hint});
  }

  arranged() {
    const {label, text, source, assumed} = this.about;
    const range = rangeWords(this.range, this.scale.unit);
    const help = [text, range && t("field.range", {range}), this.about.words?.some(Boolean) ? t("field.or", {words: this.about.words.filter(Boolean).join(", ")}) : "", source].filter(Boolean);
    const reset = h("button", {type: "button", class: "link reset", onclick: () => { this.reset(); this.input.focus(); this.heard(); }, "aria-label": t("field.reset_one", {name: label ?? this.name})}, t("field.reset"));
    return h("div", {class: "field", "data-name": this.name},
      h("div", {class: "label"}, h("label", {for: this.id}, label ?? this.name), assumed ? h("span", {class: "tag", title: source}, t("field.assumed")) : null),
      h("div", {class: "entry"}, this.input, this.scale.unit ? h("span", {class: "unit"}, this.scale.unit) : null, reset),
      h("p", {class: "help", id: `${this.id}-help`, lang: text ? "en" : null}, help.map((words, i) => [i ? h("br") : null, words])),
      this.trouble);
  }
}
