// From what was changed in a form to what is asked of the service, and to where its refusal belongs.

import {Problem} from "../api.js";

/** Fields of a scenario that decide the numbers; what it is about is no part of a question. */
export function fieldsOf(scenario) {
  const {text: _, ...fields} = scenario;
  return fields;
}

/** Fields of a scenario with values put at dotted names. */
export function merged(fields, changes) {
  const found = structuredClone(fields);
  for (const [name, value] of Object.entries(changes)) {
    const way = name.split(".");
    let place = found;
    for (const step of way.slice(0, -1)) place = place[step] ??= {};
    place[way.at(-1)] = value;
  }
  return found;
}

/** Values of a scenario by dotted name; dictionaries of the user's own names stay whole. */
export function flat(fields, whole = ["targets", "positions", "velocities"], prefix = "") {
  const found = {};
  for (const [name, value] of Object.entries(fields ?? {})) {
    const nested = value !== null && typeof value === "object" && !Array.isArray(value);
    if (nested && !whole.includes(prefix + name)) Object.assign(found, flat(value, whole, `${prefix}${name}.`));
    else found[prefix + name] = value;
  }
  return found;
}

/**
 * Say a refusal at the fields it is about and go to the first of them.
 *
 * @param find gives the field of a dotted name of the request, or nothing
 * @returns whether a field was found; if not, the refusal must be shown elsewhere
 */
export function blame(problem, find) {
  if (!(problem instanceof Problem)) return false;
  const hits = problem.fields.map(({field, detail}) => ({field: find(field), detail})).filter(({field}) => field);
  for (const {field, detail} of hits) field.say(detail, "en");
  hits[0]?.field.focus();
  return hits.length > 0;
}
