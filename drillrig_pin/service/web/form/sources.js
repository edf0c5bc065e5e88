// What forms are made from: models, their parameters, scenarios and the schema they are described by.

import {model, models, parameters, run, scenarios, scenarioSchema} from "../api.js";

/** A model, what it is called and has, and its parameters. */
export async function aboutModel(name) {
  const [facts, rows] = await Promise.all([model(name), parameters(name)]);
  return {...facts, name, parameters: rows};
}

/** Models, scenarios, their schema and, if the address names one, the run to start from. */
export async function startingPoint(from) {
  const [allModels, cases, schema, earlier] = await Promise.all([models(), scenarios(), scenarioSchema(), from ? run(from) : null]);
  return {models: allModels, scenarios: cases, schema, earlier};
}

const units = new Map();

/** Units of a model's numbers by name, asked for once. An uploaded model has none, and may be deleted by now. */
export async function unitsOf(name) {
  if (name.startsWith("upload:")) return {};
  if (!units.has(name)) units.set(name, Object.fromEntries((await parameters(name)).map((row) => [row.name, row.unit])));
  return units.get(name);
}
