// The page's words in the reader's language. Each language is one flat file of the same keys.

const LANGUAGES = {en: "English", vi: "Tiếng Việt"};
const REMEMBERED = "drillrig.language";

let words = {};
let spare = {};
let language = "en";

/** Load the remembered language, or the browser's, or English. */
export async function startWords() {
  spare = await fetched("en");
  const wanted = remembered() ?? navigator.languages.map((tag) => tag.slice(0, 2)).find((tag) => tag in LANGUAGES);
  await use(wanted in LANGUAGES ? wanted : "en");
}

/** Change to another language and remember it. */
export async function chooseLanguage(name) {
  await use(name);
  try {
    localStorage.setItem(REMEMBERED, name);
  } catch {
    // A browser that stores nothing forgets the choice, and nothing else is lost.
  }
}

/** The language in use. */
export const currentLanguage = () => language;

/** All languages, by their code. */
export const languages = () => LANGUAGES;

/** A text by its key, with `{name}` replaced by the value of that name. */
export function t(key, values = {}) {
  const text = words[key] ?? spare[key] ?? key;
  return text.replace(/\{(\w+)\}/g, (_, name) => String(values[name] ?? ""));
}

/** A text by its key, or what else is given where there is none: names that a model brings have no translation. */
export function translated(key, otherwise) {
  return words[key] ?? spare[key] ?? otherwise;
}

/** A number as this language writes it. */
export function written(text) {
  return language === "vi" ? text.replace(".", ",") : text;
}

async function use(name) {
  words = name === "en" ? spare : await fetched(name);
  language = name;
  document.documentElement.lang = name;
  document.getElementById("skip").textContent = t("page.skip");
}

async function fetched(name) {
  const answer = await fetch(`static/${name}.json`);
  return answer.json();
}

function remembered() {
  try {
    return localStorage.getItem(REMEMBERED) ?? undefined;
  } catch {
    return undefined;
  }
}
