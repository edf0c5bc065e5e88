// The case as a form, made from the schema the service describes it with: what one changes often first, the rest folded.

import {h} from "../dom.js";
import {t, translated} from "../i18n.js";
import {Field} from "./field.js";

/** What stands on top. */
const ESSENTIAL = ["duration", "pose", "integrator.rtol"];
/** What the form has other places for. */
const ELSEWHERE = ["name", "text", "model", "arguments", "loads"];
/** Dictionaries by names the model knows. */
const BY_NAME = ["targets", "positions", "velocities"];
/** Lists of words. */
const WORDS = ["lock"];

/**
 * The form of a scenario.
 *
 * @param schema JSON schema of the scenario
 * @param usual  its fields as the chosen scenario has them
 * @param model  {poses, loads, ...}: the names it may use
 */
export class ScenarioForm {
  constructor(schema, usual, model, onchange) {
    this.usual = usual;
    const fields = [...leaves(schema, schema.$defs ?? {}, usual)].map((about) => withChoices(about, model)).map((about) => new Field(about, onchange));
    this.fields = fields;
    this.loads = new Loads(model.loads ?? [], usual.loads ?? "all", onchange);
    const essential = ESSENTIAL.map((name) => this.field(name)).filter(Boolean);
    const rest = fields.filter((field) => !essential.includes(field));
    this.essentials = h("div", {class: "essentials"}, essential.map((field) => field.node), this.loads.node);
    this.rest = h("details", {class: "group"}, h("summary", {}, t("new.more"), " ", h("span", {class: "count"}, `(${rest.length})`)), h("div", {class: "fields"}, rest.map((field) => field.node)));
  }

  /** What was changed, by dotted name. */
  get values() {
    const changed = this.fields.filter((field) => field.changed).map((field) => [field.name, valueOf(field)]);
    return Object.fromEntries(this.loads.changed ? [...changed, ["loads", this.loads.value]] : changed);
  }

  field(name) {
    return this.fields.find((field) => field.name === name) ?? this.fields.find((field) => name.startsWith(`${field.name}.`));
  }

  reset() {
    this.fields.forEach((field) => field.reset());
    this.loads.reset();
  }
}

/** Which loads act. */
class Loads {
  constructor(names, usual, onchange) {
    this.names = names;
    this.usual = usual;
    this.boxes = names.map((name) => h("input", {type: "checkbox", value: name, onchange: () => onchange(this)}));
    this.node = names.length ? h("fieldset", {class: "field"}, h("legend", {class: "label"}, t("scenario.loads")), this.boxes.map((box) => h("div", {class: "entry"}, h("label", {class: "check"}, box, box.value)))) : null;
    this.write(usual);
  }

  get value() {
    const chosen = this.boxes.filter((box) => box.checked).map((box) => box.value);
    return chosen.length === this.names.length ? "all" : chosen.length ? chosen : "none";
  }

  get changed() {
    return this.names.length > 0 && String(this.value) !== String(this.usual);
  }

  write(value) {
    for (const box of this.boxes) box.checked = value === "all" || (Array.isArray(value) && value.includes(box.value));
  }

  reset() {
    this.write(this.usual);
  }
}

function* leaves(schema, definitions, usual, prefix = "") {
  for (const [name, given] of Object.entries(schema.properties ?? {})) {
    const full = prefix + name;
    if (ELSEWHERE.includes(full)) continue;
    const reference = given.$ref ?? given.allOf?.[0]?.$ref;
    const about = reference ? definitions[reference.split("/").at(-1)] : given;
    if (about.properties) yield* leaves(about, definitions, usual?.[name] ?? {}, `${full}.`);
    else yield leaf(full, {...about, ...given}, usual?.[name] ?? given.default ?? about.default);
  }
}

function leaf(name, schema, value) {
  const options = schema.anyOf ?? [schema];
  const number = options.find((option) => option.type === "number" || option.type === "integer");
  const words = options.flatMap((option) => option.enum ?? (option.const !== undefined ? [option.const] : [])).filter((word) => typeof word === "string");
  const empty = options.some((option) => option.type === "null");
  // Two units in one bracket mean that it depends on the joint.
  const unit = /\[([^\],]+)\]/.exec(schema.description ?? "")?.[1] ?? "";
  const about = {name, value: value ?? "", label: translated(`scenario.${name}`, name.replace(/_/g, " ")), text: translated(`help.${name}`, schema.description ?? ""), unit: BY_NAME.includes(name) ? "" : unit};
  if (BY_NAME.includes(name)) return {...about, kind: "text", value: pairs(value), hint: "name = value, …"};
  if (WORDS.includes(name)) return {...about, kind: "text", value: (value ?? []).join(" "), hint: "name name_.* …"};
  if (options.some((option) => option.type === "boolean")) return {...about, kind: "switch"};
  if (number) {
    const low = number.minimum ?? number.exclusiveMinimum ?? null;
    return {...about, kind: number.type, low, high: number.maximum ?? null, lowExcluded: number.exclusiveMinimum !== undefined, words: [...words, ...(empty ? [""] : [])].filter((word) => word || empty)};
  }
  return {...about, kind: "word", choices: words.length ? words : undefined};
}

function withChoices(about, model) {
  if (about.name !== "pose") return about;
  return model.poses?.length ? {...about, kind: "word", choices: ["", ...model.poses], value: about.value ?? ""} : about;
}

const pairs = (values) => Object.entries(values ?? {}).map(([name, value]) => `${name} = ${value}`).join(", ");

function valueOf(field) {
  const {value} = field;
  if (BY_NAME.includes(field.name)) {
    const entries = value.split(",").map((pair) => pair.split("=").map((word) => word.trim())).filter(([name]) => name);
    return Object.fromEntries(entries.map(([name, text]) => [name, text === undefined || Number.isNaN(Number(text)) ? text ?? "" : Number(text)]));
  }
  if (WORDS.includes(field.name)) return value.split(/\s+/).filter(Boolean);
  return value === "" ? null : value;
}
