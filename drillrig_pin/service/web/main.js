// The frame around all views: header, languages, the way in, and what is said when something fails.

import {Problem, Unreachable, health, logOut} from "./api.js";
import {h, announce} from "./dom.js";
import {chooseLanguage, currentLanguage, languages, startWords, t} from "./i18n.js";
import {place, route, show, startRouting} from "./router.js";
import {compareView} from "./views/compare.js";
import {loginView} from "./views/login.js";
import {newRunView} from "./views/new_run.js";
import {runView} from "./views/run.js";
import {runsView} from "./views/runs.js";
import {newStudyView} from "./views/sweep.js";
import {studiesView} from "./views/studies.js";
import {studyView} from "./views/study.js";

const SECTIONS = [["/", "runs.title"], ["/new", "new.title"], ["/studies", "studies.title"]];

const main = document.getElementById("main");
let guarded = false;

function header() {
  const here = place();
  const current = here === "/" || here.startsWith("/runs") || here.startsWith("/compare") ? "/" : `/${here.split("/")[1]}`;
  const links = SECTIONS.map(([address, key]) =>
    h("li", {}, h("a", {href: `#${address}`, "aria-current": address === current ? "page" : null}, t(key))));
  const choices = Object.entries(languages()).map(([code, name]) =>
    h("button", {type: "button", lang: code, "aria-pressed": String(code === currentLanguage()), onclick: () => change(code)}, name));
  document.getElementById("header").replaceChildren(h("div", {},
    h("a", {class: "name", href: "#/"}, h("img", {src: "static/icon.svg", alt: ""}), "drillrig"),
    h("nav", {"aria-label": t("page.nav")}, h("ul", {}, links)),
    guarded && !main.querySelector("#token") ? h("button", {type: "button", class: "link", onclick: () => logOut().finally(() => show())}, t("login.leave")) : null,
    h("div", {class: "languages", role: "group", "aria-label": t("page.language")}, choices)));
}

async function change(code) {
  await chooseLanguage(code);
  await show();
  document.querySelector(`#header [lang=${code}]`)?.focus();
}

/** A problem in words: the server's own, what to do, and a way on. */
function trouble(problem) {
  if (problem instanceof Problem && problem.status === 401) return loginView();
  const away = problem instanceof Unreachable;
  const missing = problem instanceof Problem && problem.status === 404;
  return h("section", {class: "empty"},
    h("h1", {}, t(away ? "problem.away" : missing ? "problem.missing" : "problem.title")),
    h("p", {lang: away ? null : "en"}, away ? t("problem.away_help") : problem.message),
    h("p", {}, h("button", {type: "button", onclick: () => show()}, t("problem.again")), " ", h("a", {class: "button", href: "#/"}, t("runs.title"))));
}

const frame = {
  show(node) {
    main.replaceChildren(...[node ?? trouble(new Problem(404, {detail: t("problem.no_page")}))].flat(Infinity).filter(Boolean));
    header();
    const title = main.querySelector("h1")?.textContent ?? "";
    document.title = title ? `${title} – drillrig` : "drillrig";
    announce(title);
    scrollTo(0, 0);
  },
  fail(problem) {
    if (!(problem instanceof Problem || problem instanceof Unreachable)) console.error(problem);
    this.show(trouble(problem));
  },
};

route("/", runsView);
route("/runs/:id", runView);
route("/new", newRunView);
route("/compare", compareView);
route("/studies", studiesView);
route("/studies/new", newStudyView);
route("/studies/:id", studyView);

await startWords();
guarded = await health().then((found) => found.login, () => false);
document.getElementById("skip").addEventListener("click", (event) => {
  event.preventDefault();
  main.focus();
});
startRouting(frame);
