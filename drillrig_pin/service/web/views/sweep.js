// A new sweep: one or two numbers of a machine over ranges, everything else as in a case or an earlier run.

import {submitStudy} from "../api.js";
import {h} from "../dom.js";
import {t} from "../i18n.js";
import {changesLabel} from "../labels.js";
import {notice} from "../parts.js";
import {go, query} from "../router.js";
import {Axis, sweepable} from "../form/axis.js";
import {Field} from "../form/field.js";
import {fieldsOf} from "../form/request.js";
import {aboutModel, startingPoint} from "../form/sources.js";

const MANY = 400;

/** The form. `?from=ID` takes everything that is not varied from a run. */
export async function newStudyView() {
  const start = await startingPoint(query().get("from"));
  const request = start.earlier;
  const model = request?.model ?? start.scenarios[0]?.model ?? start.models[0].name;
  const about = await aboutModel(model);
  const form = new SweepForm(start, request, about);
  return form.node;
}

class SweepForm {
  constructor(start, request, about) {
    this.about = about;
    this.base = base(start, request, about.name);
    const numbers = sweepable(about.parameters).map((row) => (row.name in this.base.arguments ? {...row, value: this.base.arguments[row.name]} : row));
    this.plan = h("div", {class: "said", "aria-live": "polite"});
    this.trouble = h("div");
    this.axes = [];
    this.duration = new Field({name: "duration", label: t("scenario.duration"), text: "", unit: "s", value: this.base.scenario.duration ?? 10, kind: "number", low: 0, high: null, lowExcluded: true}, () => this.tell());
    this.axes = [new Axis(1, numbers, false, () => this.tell()), new Axis(2, numbers, true, () => this.tell())];
    this.button = h("button", {class: "main", type: "submit"}, t("sweep.start_button"));
    const changes = changesLabel(this.base.arguments, Object.fromEntries(about.parameters.map((row) => [row.name, row.unit])), 6);
    const cases = start.scenarios.filter((row) => row.model === about.name);
    this.node = h("form", {novalidate: true, onsubmit: (event) => { event.preventDefault(); this.send(); }},
      h("div", {class: "top"}, h("div", {}, h("h1", {}, t("sweep.title")), h("p", {class: "facts"}, start.earlier ? t("sweep.from", {name: changes || start.earlier.name}) : t("sweep.lead")))),
      this.trouble,
      h("section", {}, this.axes.map((axis) => axis.node)),
      h("section", {}, h("h2", {}, t("sweep.rest")), h("p", {class: "aside"}, [about.name, this.base.scenario.name, changes].filter(Boolean).join(" · ")),
        h("div", {class: "essentials"}, !start.earlier && cases.length > 1 ? this.caseChoice(cases) : null, this.duration.node)),
      h("div", {class: "bar"}, this.plan, h("div", {class: "actions"}, this.button)));
    this.tell();
  }

  caseChoice(cases) {
    const choose = (event) => { this.base.scenario = fieldsOf(cases.find((row) => row.name === event.target.value).scenario); };
    return h("div", {class: "field"}, h("div", {class: "label"}, h("label", {for: "sweep-case"}, t("new.scenario"))), h("div", {class: "entry"}, h("select", {id: "sweep-case", onchange: choose}, cases.map((row) => h("option", {value: row.name, selected: row.name === this.base.scenario.name}, row.name)))));
  }

  tell() {
    if (this.axes.length < 2) return;
    const lengths = this.axes.filter((axis) => axis.row).map((axis) => axis.length);
    const cases = lengths.reduce((product, length) => product * length, 1);
    this.plan.replaceChildren(h("span", {class: "plan"}, lengths.length ? t("sweep.cases", {product: lengths.join(" × "), n: cases}) : t("sweep.choose")), cases > MANY ? h("span", {class: "worse"}, " ", t("sweep.many")) : "");
  }

  async send() {
    this.trouble.replaceChildren();
    const wrong = [...this.axes, this.duration].filter((part) => !part.check());
    if (wrong.length) {
      (wrong[0].name.focus ? wrong[0].name : wrong[0].input).focus();
      return;
    }
    const axes = this.axes.filter((axis) => axis.row).map((axis) => axis.value);
    if (axes.length === 2 && axes[0].name === axes[1].name) {
      this.trouble.replaceChildren(notice({message: t("sweep.twice")}));
      return;
    }
    this.button.disabled = true;
    try {
      const record = await submitStudy(studyRequest(this.about.name, this.base, axes, this.duration.value));
      go(`/studies/${record.id}`);
    } catch (problem) {
      this.button.disabled = false;
      this.trouble.replaceChildren(notice(problem));
      this.trouble.scrollIntoView({block: "center"});
    }
  }
}

/** What all cases share: that of a run, or that of the first case of the model. */
function base(start, request, model) {
  const shipped = start.scenarios.find((row) => row.model === model);
  return {arguments: {...(request?.arguments ?? {})}, scenario: fieldsOf(request?.scenario ?? shipped?.scenario ?? {})};
}

/** The study that is asked for. What is varied is not set as well. */
function studyRequest(model, {arguments: given, scenario}, axes, duration) {
  const varied = axes.map((axis) => axis.name);
  const set = Object.fromEntries(Object.entries(given).map(([name, value]) => [`model.${name}`, value]).filter(([name]) => !varied.includes(name)));
  const name = axes.map((axis) => axis.name.replace("model.", "")).join(" × ");
  return {name, model, scenario: {...scenario, duration}, set, axes};
}
