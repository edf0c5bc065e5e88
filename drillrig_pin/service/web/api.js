// What the service answers, and how its refusals (RFC 9457 problem details) reach the page.

/** A refusal, with the server's own sentences and the fields they are about. */
export class Problem extends Error {
  constructor(status, document) {
    super(document.detail ?? document.title ?? `HTTP ${status}`);
    this.status = status;
    this.retryAfter = document.retry_after ?? null;
    this.fields = document.errors?.length ? document.errors : document.field ? [{field: document.field, detail: this.message}] : [];
  }
}

/** The server cannot be reached. */
export class Unreachable extends Error {}

async function request(method, path, {body, signal, type = "application/json"} = {}) {
  const headers = {Accept: "application/json"};
  if (body !== undefined) headers["Content-Type"] = type;
  let answer;
  try {
    answer = await fetch(path, {method, headers, body, signal, credentials: "same-origin"});
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Unreachable(error.message);
  }
  const text = await answer.text();
  const json = (answer.headers.get("Content-Type") ?? "").includes("json");
  if (!answer.ok) {
    const problem = json ? JSON.parse(text) : {};
    throw new Problem(answer.status, {...problem, retry_after: answer.headers.get("Retry-After")});
  }
  return json ? JSON.parse(text) : null;
}

const get = (path, signal) => request("GET", path, {signal});
const post = (path, document) => request("POST", path, {body: JSON.stringify(document)});
const part = encodeURIComponent;

/** An address of the API with its questions; those without a value are left out. */
export function address(path, questions = {}) {
  const given = Object.entries(questions).filter(([, value]) => value !== undefined && value !== null && value !== "");
  return given.length ? `${path}?${new URLSearchParams(given)}` : path;
}

export const models = () => get("v1/models");
export const model = (name) => get(`v1/models/${part(name)}`);
export const parameters = (name) => get(`v1/models/${part(name)}/parameters`);
export const scenarios = () => get("v1/scenarios");
export const scenarioSchema = () => get("v1/schema/scenario");
export const figures = (id) => get(`v1/runs/${part(id)}/figures`);

export const runs = (questions, signal) => get(address("v1/runs", questions), signal);
export const run = (id) => get(`v1/runs/${part(id)}`);
export const metrics = (id) => get(`v1/runs/${part(id)}/metrics`);
export const submitRun = (document) => post("v1/runs", document);
export const cancelRun = (id) => request("POST", `v1/runs/${part(id)}/cancel`);
export const deleteRun = (id) => request("DELETE", `v1/runs/${part(id)}`);
export const compare = (a, b) => get(address("v1/compare", {a, b}));

export const studies = (questions) => get(address("v1/studies", questions));
export const study = (id) => get(`v1/studies/${part(id)}`);
export const submitStudy = (document) => post("v1/studies", document);
export const studyTable = (id) => get(address(`v1/studies/${part(id)}/table`, {format: "json"}));
export const cancelStudy = (id) => request("POST", `v1/studies/${part(id)}/cancel`);
export const deleteStudy = (id) => request("DELETE", `v1/studies/${part(id)}`);

export const logIn = (token) =>
  request("POST", "login", {body: new URLSearchParams({token}), type: "application/x-www-form-urlencoded"});

export const logOut = () => request("POST", "logout");
export const health = () => get("healthz");

/** Where a file of a run is. */
export const fileOf = (id, name, questions = {}) => address(`v1/runs/${part(id)}/${name}`, questions);
export const fileOfStudy = (id, name, questions = {}) => address(`v1/studies/${part(id)}/${name}`, questions);
