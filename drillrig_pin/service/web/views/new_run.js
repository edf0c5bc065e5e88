// A new run: a machine, a case, and only what is to be different; then Run.

import {submitRun} from "../api.js";
import {freshId, h} from "../dom.js";
import {currentLanguage, t} from "../i18n.js";
import {notice} from "../parts.js";
import {go, query} from "../router.js";
import {ParameterForm} from "../form/parameters.js";
import {blame, fieldsOf, flat, merged} from "../form/request.js";
import {ScenarioForm} from "../form/scenario.js";
import {aboutModel, startingPoint} from "../form/sources.js";

/** What stands in the form, so that another language does not cost it. */
let draft = null;

/** The form. `?from=ID` starts from what another run was asked. */
export async function newRunView() {
  const from = query().get("from");
  const start = await startingPoint(from);
  const form = new RunForm(start, draft?.from === from && draft.language !== currentLanguage() ? draft : null);
  await form.build();
  return form.node;
}

class RunForm {
  constructor(start, kept) {
    this.start = start;
    this.kept = kept;
    this.request = start.earlier;
    this.model = kept?.model ?? this.request?.model ?? start.scenarios[0]?.model ?? start.models[0].name;
    this.scenario = start.scenarios.find((row) => row.name === (kept?.name ?? this.request?.scenario.name)) ?? caseOf(start, this.model);
    this.trouble = h("div");
    this.place = h("div");
    this.node = h("form", {novalidate: true, onsubmit: (event) => { event.preventDefault(); this.send(); }},
      h("div", {class: "top"}, h("div", {}, h("h1", {}, t("new.title")), h("p", {class: "facts"}, start.earlier ? [t("new.from"), " ", h("a", {href: `#/runs/${start.earlier.id}`}, start.earlier.name)] : t("new.lead")))),
      this.place);
  }

  /** Make the form anew for the chosen machine and case; what was typed for the same names is kept. */
  async build() {
    const kept = this.kept ?? {parameters: this.parameters?.values ?? this.request?.arguments ?? {}, scenario: this.case?.values ?? {}};
    this.kept = null;
    this.about = await aboutModel(this.model);
    const usual = this.scenario.scenario;
    const heard = () => this.tell();
    this.parameters = new ParameterForm(this.about.parameters, heard);
    this.case = new ScenarioForm(this.start.schema, usual, this.about, heard);
    for (const [name, value] of Object.entries(kept.parameters)) this.parameters.field(name)?.write(value);
    if (this.request) this.fill(flat(this.request.scenario));
    this.fill(kept.scenario);
    this.place.replaceChildren(this.trouble, this.top(), this.parameters.node, h("section", {}, this.case.rest), this.bar());
    this.tell();
  }

  fill(values) {
    for (const [name, value] of Object.entries(values)) {
      if (name === "loads") this.case.loads.write(value);
      else this.case.fields.find((field) => field.name === name)?.take(value);
    }
  }

  top() {
    const choose = (label, options, chosen, onchange) => {
      const id = freshId("choice");
      return h("div", {class: "field"}, h("div", {class: "label"}, h("label", {for: id}, label)), h("div", {class: "entry"}, h("select", {id, onchange}, options.map(({name}) => h("option", {value: name, selected: name === chosen}, name)))));
    };
    const cases = this.start.scenarios.filter((row) => !row.model || row.model === this.model);
    const machine = choose(t("new.model"), this.start.models.map((row) => ({name: row.name})), this.model, (event) => { this.model = event.target.value; this.scenario = caseOf(this.start, this.model); this.rebuild(); });
    const scenario = cases.length ? choose(t("new.scenario"), cases, this.scenario.name, (event) => { this.scenario = cases.find((row) => row.name === event.target.value); this.rebuild(); }) : null;
    const text = this.scenario.text ? h("p", {class: "aside", lang: "en"}, this.scenario.text) : null;
    return h("section", {"aria-labelledby": "case-title"}, h("h2", {id: "case-title"}, t("new.case")), h("div", {class: "essentials"}, machine, scenario), text, this.case.essentials);
  }

  rebuild() {
    this.request = null;
    this.build().catch((problem) => this.trouble.replaceChildren(notice(problem)));
  }

  bar() {
    this.said = h("div", {class: "said"});
    this.button = h("button", {class: "main", type: "submit"}, t("new.run"));
    this.undo = h("button", {type: "button", onclick: () => this.reset()}, t("new.reset_all"));
    return h("div", {class: "bar"}, this.said, h("div", {class: "actions"}, this.undo, this.button));
  }

  reset() {
    this.parameters.fields.forEach((field) => field.reset());
    this.case.reset();
    this.tell();
  }

  /** What will be sent, in one line. */
  tell() {
    const fields = [...this.parameters.fields, ...this.case.fields].filter((field) => field.changed);
    const loads = this.case.loads.changed ? [`${t("scenario.loads")}: ${[this.case.loads.value].flat().join(", ") }`] : [];
    const words = [...fields.map((field) => `${field.about.label ?? field.name} = ${field.words}`), ...loads];
    const assumed = this.about.parameters.filter((row) => row.assumed && !(row.name in this.parameters.values)).length;
    draft = {from: query().get("from"), language: currentLanguage(), model: this.model, name: this.scenario.name, parameters: this.parameters.values, scenario: this.case.values};
    this.undo.disabled = !words.length;
    this.said.replaceChildren(
      h("div", {"aria-live": "polite"}, words.length ? t("new.changed", {n: words.length}) : t("new.unchanged"), assumed ? h("span", {class: "aside"}, " · ", t("new.assumed", {n: assumed, of: this.about.parameters.length})) : null),
      words.length ? h("ul", {class: "given"}, words.slice(0, 8).map((text) => h("li", {}, h("code", {}, text))), words.length > 8 ? h("li", {}, `+${words.length - 8}`) : null) : "");
  }

  async send() {
    this.trouble.replaceChildren();
    const wrong = [...this.parameters.fields, ...this.case.fields].filter((field) => !field.check());
    if (wrong.length) {
      wrong[0].focus();
      return;
    }
    this.button.disabled = true;
    try {
      const scenario = merged(fieldsOf(this.scenario.scenario), this.case.values);
      const record = await submitRun({model: this.model, arguments: this.parameters.values, scenario});
      go(`/runs/${record.id}`);
    } catch (problem) {
      this.button.disabled = false;
      if (!blame(problem, (name) => this.find(name))) {
        this.trouble.replaceChildren(notice(problem));
        this.trouble.scrollIntoView({block: "center"});
      }
    }
  }

  find(name) {
    const [kind, ...rest] = name.split(".");
    if (kind === "arguments") return this.parameters.field(rest.join("."));
    return kind === "scenario" ? this.case.field(rest.join(".")) : null;
  }
}

/** The shipped case of a model; one without is named after it and has every default. */
function caseOf(start, model) {
  return start.scenarios.find((row) => row.model === model) ?? {name: model, text: "", scenario: {name: model}};
}
