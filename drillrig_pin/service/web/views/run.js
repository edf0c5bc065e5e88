// One run: its progress while it is computed, then what it says, shows and leaves to take along.

import {cancelRun, deleteRun, figures, fileOf, metrics, run} from "../api.js";
import {h} from "../dom.js";
import {t, currentLanguage} from "../i18n.js";
import {changesLabel, locksLabel} from "../labels.js";
import {carefulButton, ended, notice, statusBadge} from "../parts.js";
import {moment, number, percentWords, plain, withUnit} from "../units.js";
import {go, show} from "../router.js";
import {result} from "./result.js";
import {unitsOf} from "../form/sources.js";
import {watched} from "./job.js";

/** The view of a run. */
export async function runView(context, id) {
  const record = await run(id);
  const units = await unitsOf(record.model).catch(() => ({}));
  if (!ended(record)) {
    const job = {
      record,
      events: fileOf(id, "events"),
      ask: () => run(id),
      cancel: () => cancelRun(id),
      words: (now, share) => share === 1 ? t("job.ending") : t("job.share", {percent: percentWords(share ?? 0), time: number((share ?? 0) * record.scenario.duration, 3), end: number(record.scenario.duration, 3)}),
    };
    return [head(record, units), watched(context, job, () => context.alive() && show())];
  }
  if (record.status !== "completed") return [head(record, units), stopped(record)];
  const found = await metrics(id);
  const drawn = found.samples >= 2 ? await figures(id) : [];
  return [head(record, units), result(record, found, drawn)];
}

function head(record, units) {
  const changes = changesLabel(record.arguments, units, 6);
  const again = h("a", {class: "button main", href: `#/new?from=${record.id}`}, t("run.again"));
  const other = ended(record) ? h("a", {class: "button", href: `#/studies/new?from=${record.id}`}, t("run.sweep")) : null;
  const remove = ended(record) ? carefulButton(t("run.delete"), t("run.delete_sure"), async () => { await deleteRun(record.id); go("/"); }) : null;
  const facts = [record.model, changes ? record.name : t("runs.unchanged"), locksLabel(record), withUnit(plain(record.scenario.duration), "s"), moment(record.created, currentLanguage())].filter(Boolean);
  return h("div", {class: "top"},
    h("div", {}, h("h1", {}, changes || record.name), h("p", {class: "facts"}, facts.join(" · "))),
    h("div", {class: "actions"}, again, other, remove));
}

function stopped(record) {
  return h("section", {}, h("p", {}, statusBadge(record)),
    record.error ? notice(record.error) : h("p", {}, t("run.cancelled")),
    record.error ? null : h("p", {class: "aside"}, t("run.cancelled_help")));
}
