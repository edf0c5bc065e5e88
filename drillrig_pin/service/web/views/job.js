// What one sees while a job is computed: how far it is, how long it takes, and the way to stop it.

import {announce, h} from "../dom.js";
import {t} from "../i18n.js";
import {ended, statusBadge} from "../parts.js";
import {follow} from "../follow.js";
import {shareOf} from "../records.js";

/**
 * Show a job until it has ended.
 *
 * @param context of the view
 * @param job {record, events, ask, cancel, words, heard}: `words` describes a share, `heard` is called with every record
 * @param over is called with the last record
 */
export function watched(context, {record, events, ask, cancel, words, heard}, over) {
  const bar = h("progress", {max: 1, "aria-label": t("job.progress")});
  const share = h("p", {class: "share"});
  const badge = h("span");
  const stop = h("button", {type: "button", onclick: async () => {
    stop.disabled = true;
    stop.textContent = t("job.cancelling");
    await cancel().catch(() => { stop.disabled = false; });
  }}, t("run.cancel"));
  let said = -1;
  const tell = (news) => {
    const now = {...record, ...news};
    const done = shareOf(now);
    if (now.status === "queued" || done === null) bar.removeAttribute("value");
    else bar.value = done;
    badge.replaceChildren(statusBadge(now));
    share.textContent = now.status === "queued" ? t("job.queued") : words(now, done);
    // Ten times in all, so that those who listen hear something else as well.
    const tenth = Math.floor((done ?? 0) * 10);
    if (tenth !== said) announce(share.textContent);
    said = tenth;
    heard?.(now);
    if (ended(now)) over(now);
  };
  const quit = follow({events, ask, tell, ended});
  context.atEnd(quit);
  queueMicrotask(() => tell(record));
  return h("section", {class: "job", "aria-label": t("job.progress")},
    h("div", {class: "actions"}, badge, share), bar, h("div", {class: "actions"}, stop));
}
