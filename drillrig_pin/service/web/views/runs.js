// All runs: found by words and status, with the numbers one looks at first; two of them can be compared.

import {cancelRun, deleteRun, runs} from "../api.js";
import {announce, freshId, h, settled, table} from "../dom.js";
import {currentLanguage, t} from "../i18n.js";
import {changesLabel, locksLabel, quantityLabel} from "../labels.js";
import {carefulButton, ended, numberOf, progressBar, statusBadge, verdictBadge} from "../parts.js";
import {go, query} from "../router.js";
import {moment, plain, withUnit} from "../units.js";
import {unitsOf} from "../form/sources.js";
import {sharedKeys, shareOf} from "../records.js";

const PAGE = 20;
const STATUSES = ["queued", "running", "completed", "failed", "cancelled"];
const REFRESH = 1500;

/** The list. Its search is part of the address, so that it can be kept and sent. */
export async function runsView(context) {
  const asked = query();
  const state = {search: asked.get("search") ?? "", status: asked.get("status") ?? "", before: [], after: null, picked: []};
  const list = h("div");
  const found = h("output", {"aria-live": "polite"});
  const compare = h("button", {type: "button", disabled: true, title: t("runs.compare_hint"), onclick: () => go(`/compare?a=${state.picked[0]}&b=${state.picked[1]}`)}, t("runs.compare"));

  const pick = (id, on) => {
    state.picked = state.picked.filter((other) => other !== id);
    if (on) state.picked.push(id);
    // Two at a time: the third takes the place of the first.
    while (state.picked.length > 2) state.picked.shift();
    for (const box of list.querySelectorAll(".pick input")) box.checked = state.picked.includes(box.value);
    compare.disabled = state.picked.length !== 2;
    announce(t("runs.picked", {n: state.picked.length}));
  };

  let timer = 0;
  context.atEnd(() => clearTimeout(timer));
  const load = async () => {
    clearTimeout(timer);
    const page = await runs({search: state.search, status: state.status, limit: PAGE, after: state.after}, context.signal.signal);
    if (!context.alive()) return;
    const units = Object.fromEntries(await Promise.all([...new Set(page.items.map((run) => run.model))].map(async (name) => [name, await unitsOf(name).catch(() => ({}))])));
    if (!context.alive()) return;
    const held = document.activeElement?.dataset?.key;
    found.textContent = t("runs.found", {n: page.items.length});
    list.replaceChildren(page.items.length ? rows(page, units, state, pick, load) : nothing(state), pages(page, state, load));
    if (held) list.querySelector(`[data-key="${held}"]`)?.focus();
    if (page.items.some((run) => !ended(run))) timer = setTimeout(() => load().catch(() => {}), REFRESH);
  };
  const search = settled(() => {
    state.before = [];
    state.after = null;
    const questions = new URLSearchParams(Object.entries({search: state.search, status: state.status}).filter(([, value]) => value));
    history.replaceState(null, "", `#/${questions.size ? `?${questions}` : ""}`);
    load().catch(() => {});
  });
  await load();
  return [head(), h("section", {},
    h("div", {class: "filter", role: "search"},
      h("label", {}, h("span", {}, t("runs.search")), h("input", {type: "search", value: state.search, placeholder: t("runs.search_hint"), oninput: (event) => { state.search = event.target.value; search(); }})),
      h("label", {}, h("span", {}, t("runs.status")), statusChoice(state, search)),
      found, h("div", {class: "end actions"}, compare)),
    list)];
}

function head() {
  return h("div", {class: "top"}, h("h1", {}, t("runs.title")), h("div", {class: "actions"}, h("a", {class: "button main", href: "#/new"}, t("new.title"))));
}

function statusChoice(state, search) {
  const options = ["", ...STATUSES].map((status) => h("option", {value: status, selected: status === state.status}, status ? t(`status.${status}`) : t("runs.any_status")));
  return h("select", {onchange: (event) => { state.status = event.target.value; search(); }}, options);
}

function nothing(state) {
  const filtered = state.search || state.status;
  return h("div", {class: "empty"}, h("p", {}, t(filtered ? "runs.none_found" : "runs.none")), filtered ? null : h("a", {class: "button main", href: "#/new"}, t("runs.first")));
}

function rows(page, units, state, pick, load) {
  const keys = sharedKeys(page.items);
  const head = (name, words) => h("th", {scope: "col", class: name}, words);
  const unseen = (text) => h("span", {class: "unseen"}, text);
  const heads = [head("pick", unseen(t("runs.pick"))), head("words", t("runs.what")), head("words", t("runs.how")), ...keys.map((key) => quantityLabel(key)), head("less", t("runs.when")), unseen(t("runs.do"))];
  const lines = page.items.map((run) => ({cells: [
    box(run, state, pick),
    h("td", {class: "what"}, what(run, units[run.model])),
    h("td", {class: "words"}, how(run)),
    ...keys.map((key) => numberOf(run.numbers, key)),
    h("td", {class: "less"}, moment(run.created, currentLanguage())),
    h("td", {}, remove(run, load)),
  ]}));
  const shown = table(heads, lines, {class: "runs", label: t("runs.title")});
  for (const cell of shown.querySelectorAll("tbody th")) cell.className = "pick";
  return shown;
}

function box(run, state, pick) {
  const id = freshId("pick");
  const attributes = {type: "checkbox", id, value: run.id, checked: state.picked.includes(run.id), disabled: run.status !== "completed", "data-key": `pick-${run.id}`, onchange: (event) => pick(run.id, event.target.checked)};
  return h("label", {for: id}, h("input", attributes), h("span", {class: "unseen"}, t("runs.pick_one", {name: run.name})));
}

function what(run, units) {
  const changes = changesLabel(run.arguments, units);
  return [h("a", {href: `#/runs/${run.id}`, "data-key": `open-${run.id}`}, changes || run.name), h("p", {class: "facts"}, [run.model, changes ? run.name : t("runs.unchanged"), locksLabel(run), run.outcome ? withUnit(plain(run.outcome.time), "s") : null].filter(Boolean).join(" · "))];
}

function how(run) {
  if (run.status === "running") return progressBar(shareOf(run), t("status.running"));
  return run.verdict ? verdictBadge(run.verdict) : statusBadge(run);
}

function remove(run, load) {
  const again = () => load().catch(() => {});
  if (!ended(run)) return h("button", {type: "button", class: "link", "data-key": `cancel-${run.id}`, onclick: () => cancelRun(run.id).finally(again)}, t("run.cancel"));
  const button = carefulButton(t("run.delete"), t("run.delete_sure"), () => deleteRun(run.id).finally(again));
  button.classList.add("link");
  button.setAttribute("aria-label", t("run.delete_one", {name: run.name}));
  return button;
}

function pages(page, state, load) {
  const turn = (forward) => {
    if (forward) state.before.push(state.after);
    state.after = forward ? page.next : state.before.pop();
    load().catch(() => {});
  };
  if (!page.next && !state.before.length) return h("div");
  return h("div", {class: "pages"},
    h("button", {type: "button", disabled: !state.before.length, onclick: () => turn(false)}, t("runs.newer")),
    h("button", {type: "button", disabled: !page.next, onclick: () => turn(true)}, t("runs.older")));
}
