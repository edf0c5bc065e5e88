// Small pieces that several views show: how a job stands, the verdict, problems, figures in cards.

import {h} from "./dom.js";
import {t, translated} from "./i18n.js";
import {quantityLabel, statusLabel} from "./labels.js";
import {levelOf} from "./records.js";
import {quantity} from "./units.js";

const KINDS = {completed: "good", failed: "bad", cancelled: "note", queued: "note", running: "near"};

/** Whether a job has ended. */
export const ended = (record) => ["completed", "failed", "cancelled"].includes(record.status);

/** How a job stands, as a badge. */
export function statusBadge(record) {
  return h("span", {class: `badge ${KINDS[record.status] ?? "note"}`}, statusLabel(record.status));
}

/** The verdict of a run as a badge; nothing where there is none. */
export function verdictBadge(verdict) {
  if (!verdict) return null;
  const level = levelOf(verdict.level);
  return h("span", {class: `badge ${level}`}, t(`level.${level}`));
}

/** A bar that fills; without a share it only says that something goes on. */
export function progressBar(share, label) {
  return h("progress", {max: 1, value: share ?? null, "aria-label": label});
}

/** Key numbers as cards: rows of label, value in words, and a note. */
export function cards(rows) {
  return h("dl", {class: "cards"}, rows.map(({label, value, note}) =>
    h("div", {}, h("dt", {}, label), h("dd", {class: "value"}, value), note ? h("dd", {class: "note"}, note) : null)));
}

/** One number of a run by its key, in words; a dash where the run has none. */
export function numberOf(numbers, key) {
  const found = numbers?.[key];
  return found ? quantity(found.value, found.unit) : "–";
}

/** A refusal of the server, to be put above what it is about. */
export function notice(problem, kind = "bad") {
  return h("div", {class: `notice ${kind}`, role: "alert"},
    h("p", {lang: problem.message && !problem.status ? null : "en"}, problem.message ?? problem.detail),
    problem.retryAfter ? h("p", {}, t("problem.retry", {seconds: problem.retryAfter})) : null);
}

/** A button that asks once more before it does what cannot be undone. */
export function carefulButton(label, question, action) {
  const button = h("button", {type: "button", onclick: async () => {
    if (button.dataset.sure !== "yes") {
      button.dataset.sure = "yes";
      button.textContent = question;
      return;
    }
    button.disabled = true;
    await action();
  }, onblur: () => {
    delete button.dataset.sure;
    button.textContent = label;
  }}, label);
  return button;
}

/** A choice of metrics by their keys, in the reader's words. */
export function metricChoice(keys, chosen, onchange) {
  return h("select", {onchange: (event) => onchange(event.target.value)},
    keys.map((key) => h("option", {value: key, selected: key === chosen}, quantityLabel(key))));
}

/** Words of a kind the server names (`hole`, `motion`): translated where the page knows it. */
export const kindLabel = (kind) => translated(`kind.${kind.replace(/ /g, "_")}`, kind);
