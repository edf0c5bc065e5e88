// The way in where the server asks for a token. It goes over in the body of a form and comes back as a cookie.

import {Problem, logIn} from "../api.js";
import {h} from "../dom.js";
import {t} from "../i18n.js";
import {show} from "../router.js";

/** The form; the view that was asked for follows it. */
export function loginView() {
  const input = h("input", {id: "token", type: "password", name: "token", autocomplete: "current-password", required: true, "aria-describedby": "token-trouble"});
  const trouble = h("p", {id: "token-trouble", class: "worse", role: "alert"});
  const button = h("button", {class: "main", type: "submit"}, t("login.enter"));
  const enter = async (event) => {
    event.preventDefault();
    button.disabled = true;
    try {
      await logIn(input.value);
      await show();
    } catch (problem) {
      const wrong = problem instanceof Problem && problem.status === 401;
      trouble.textContent = wrong ? t("login.wrong") : problem.message;
      input.setAttribute("aria-invalid", "true");
      input.select();
    } finally {
      button.disabled = false;
    }
  };
  queueMicrotask(() => input.focus());
  return h("section", {class: "login"},
    h("h1", {}, t("login.title")),
    h("p", {}, t("login.why")),
    h("form", {onsubmit: enter},
      h("label", {for: "token"}, t("login.token")), input, trouble, h("div", {class: "actions"}, button)),
    h("p", {class: "aside"}, t("login.where")));
}
