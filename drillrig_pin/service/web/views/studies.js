// All sweeps and studies.

import {deleteStudy, studies} from "../api.js";
import {h, table} from "../dom.js";
import {currentLanguage, t} from "../i18n.js";
import {carefulButton, ended, progressBar, statusBadge} from "../parts.js";
import {shareOf} from "../records.js";
import {moment} from "../units.js";

const REFRESH = 1500;
const SHOWN = 100;

/** The list. */
export async function studiesView(context) {
  const list = h("section");
  let timer = 0;
  context.atEnd(() => clearTimeout(timer));
  const load = async () => {
    const page = await studies({limit: SHOWN});
    if (!context.alive()) return;
    list.replaceChildren(page.items.length ? rows(page.items, load) : h("div", {class: "empty"}, h("p", {}, t("studies.none")), h("a", {class: "button main", href: "#/studies/new"}, t("sweep.title"))));
    if (page.items.some((study) => !ended(study))) timer = setTimeout(() => load().catch(() => {}), REFRESH);
  };
  await load();
  return [h("div", {class: "top"}, h("h1", {}, t("studies.title")), h("div", {class: "actions"}, h("a", {class: "button main", href: "#/studies/new"}, t("sweep.title")))), list];
}

function remove(study, load) {
  const button = carefulButton(t("run.delete"), t("run.delete_sure"), () => deleteStudy(study.id).finally(load));
  button.classList.add("link");
  button.setAttribute("aria-label", t("run.delete_one", {name: study.name}));
  return button;
}

function rows(all, load) {
  const lines = all.map((study) => [
    h("a", {href: `#/studies/${study.id}`}, study.name),
    h("td", {class: "words"}, study.model),
    String(study.cases),
    h("td", {class: "words"}, study.status === "running" ? progressBar(shareOf(study), t("status.running")) : statusBadge(study)),
    h("td", {class: "less"}, moment(study.created, currentLanguage())),
    ended(study) ? remove(study, load) : "",
  ]);
  const head = (name, words) => h("th", {scope: "col", class: name}, words);
  return table([t("studies.what"), head("words", t("new.model")), t("studies.cases"), head("words", t("runs.how")), head("less", t("runs.when")), h("span", {class: "unseen"}, t("runs.do"))], lines, {label: t("studies.title")});
}
