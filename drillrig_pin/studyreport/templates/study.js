"use strict";
// Draws the figures of the metric that is chosen, ranks the cases, and shows how each of them is opened.
(() => {
  const study = JSON.parse(document.getElementById("study-data").textContent);
  const FEW = 200;
  const columns = new Map(study.columns.map((column) => [column.key, column]));
  const rowOf = new Map(study.cases.map((number, i) => [number, i]));
  const choice = document.getElementById("metric");
  const parallel = document.getElementById("parallel");
  const rows = study.cases.map((_, i) => i);
  let metric = study.metric;
  let sorting = null;
  let opened = false;

  const known = (value) => value !== null && value !== undefined;
  const words = (value, digits = 4) => (!known(value) ? "–" : typeof value === "string" ? value : value !== 0 && (Math.abs(value) < 1e-4 || Math.abs(value) >= 1e6) ? value.toExponential(digits - 2) : String(Number(value.toPrecision(digits))).replace("-", "−"));
  const unit = (column) => (column.unit ? ` ${column.unit}` : "");

  function element(tag, properties = {}, ...children) {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children.filter((child) => child !== null));
    return made;
  }

  // How a value stands to its limit: as the report judges it.
  function standing(column, value) {
    if (!known(column.limit) || !known(value)) return "";
    if (column.least ? value < column.limit : value > column.limit) return "bad";
    return !column.least && column.limit > 0 && value > 0.8 * column.limit ? "near" : "";
  }

  // Rows with a value of the chosen metric, best first.
  function ranked() {
    const column = columns.get(metric);
    const sign = column.better === "higher" ? -1 : 1;
    return rows.filter((i) => study.status[i] === "completed" && known(column.values[i])).sort((a, b) => sign * (column.values[a] - column.values[b]));
  }

  function shownColumns() {
    const all = document.getElementById("everything").checked;
    const chosen = columns.get(metric);
    const found = study.columns.filter((column) => column.kind === "input");
    found.push(chosen);
    for (const column of study.columns) {
      if (found.includes(column)) continue;
      const broken = known(column.limit) && !column.key.endsWith(".p_max") && !column.key.endsWith(".p_min");
      if (all || column.kind === "extreme" || broken) found.push(column);
    }
    return found;
  }

  function matches(i, query, level) {
    if (level && study.level[i] !== level) return false;
    return query.every((word) => {
      const comparison = word.match(/^(.+?)(<=|>=|<|>|=)(.+)$/);
      if (comparison) {
        const [, name, sign, text] = comparison;
        const column = study.columns.find((one) => one.key.toLowerCase() === name || one.key.toLowerCase().endsWith(`.${name}`) || one.label.toLowerCase() === name);
        if (!column || !known(column.values[i])) return false;
        const value = column.values[i];
        const bound = typeof value === "string" ? text : Number(text);
        return { "<": value < bound, ">": value > bound, "<=": value <= bound, ">=": value >= bound, "=": typeof value === "string" ? value.toLowerCase() === bound : value === bound }[sign];
      }
      return texts[i].includes(word);
    });
  }

  const texts = rows.map((i) => [study.cases[i], study.status[i], study.reason[i], ...study.columns.filter((column) => column.kind === "input" || column.whose).map((column) => (column.whose ? column.whose[i] : column.values[i]))].join(" ").toLowerCase());

  function ordered() {
    const query = document.getElementById("find").value.toLowerCase().split(/\s+/).filter(Boolean);
    const level = document.getElementById("level").value;
    const kept = rows.filter((i) => matches(i, query, level));
    const worst = ranked().reverse();
    const place = new Map(worst.map((i, k) => [i, k]));
    if (!sorting) return kept.sort((a, b) => (place.get(a) ?? Infinity) - (place.get(b) ?? Infinity) || a - b);
    const value = sorting.key === "case" ? (i) => study.cases[i] : sorting.key === "verdict" ? (i) => ["BAD", "NEAR", "NOTE", "GOOD"].indexOf(study.level[i]) : (i) => columns.get(sorting.key).values[i];
    return kept.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (!known(x) || !known(y)) return known(y) - known(x);
      return sorting.sign * (typeof x === "string" ? x.localeCompare(y, undefined, { numeric: true }) : x - y);
    });
  }

  function heading(key, label, column) {
    const button = element("button", { type: "button", title: "Sort" }, label);
    if (column && known(column.limit)) button.append(element("span", { className: "limit" }, column.limit_words));
    button.addEventListener("click", () => {
      sorting = { key, sign: sorting && sorting.key === key ? -sorting.sign : 1 };
      fill();
    });
    const cell = element("th", { scope: "col" }, button);
    if (sorting && sorting.key === key) cell.ariaSort = sorting.sign > 0 ? "ascending" : "descending";
    if (key === "verdict" || (column && typeof column.values.find(known) === "string")) cell.className = "text";
    return cell;
  }

  function verdict(i) {
    if (study.status[i] !== "completed") return study.status[i];
    const names = study.over[i].map((key) => columns.get(key).label);
    const shown = names.slice(0, 2).join("; ") + (names.length > 2 ? `; ${names.length - 2} more` : "");
    return { BAD: `over: ${shown}`, NEAR: `near: ${shown}`, GOOD: "OK", NOTE: "–" }[study.level[i]];
  }

  function row(i, shown, best, worst) {
    const mark = i === worst ? element("span", { className: "worst-mark" }, "worst") : i === best ? element("span", { className: "best-mark" }, "best") : null;
    const open = element("button", { type: "button", title: "Show this case" }, String(study.cases[i]));
    const line = element("tr", {}, element("th", { scope: "row", className: "text" }, open, mark ? " " : "", mark));
    for (const column of shown) {
      const value = column.values[i];
      const cell = element("td", { className: `${standing(column, value)}${typeof value === "string" ? " text" : ""}` }, words(value, column.kind === "input" ? 6 : 4));
      if (column.whose && column.whose[i]) cell.append(element("span", { className: "whose" }, ` ${column.whose[i]}`));
      if (column.key === "hole" && study.assumed[i]) cell.append(element("span", { className: "tag" }, "assumed"));
      line.append(cell);
      if (column.key === metric) line.append(element("td", { className: `text ${{ BAD: "bad", NEAR: "near" }[study.level[i]] ?? ""}` }, verdict(i)));
    }
    line.addEventListener("click", () => show(study.cases[i]));
    return line;
  }

  function fill() {
    const table = document.getElementById("ranking-table");
    const shown = shownColumns();
    table.tHead.rows[0].replaceChildren(heading("case", "case"), ...shown.flatMap((column) => [heading(column.key, `${column.label}${column.unit ? ` [${column.unit}]` : ""}`, column), ...(column.key === metric ? [heading("verdict", "verdict")] : [])]));
    const order = ordered();
    const best = ranked();
    const drawn = opened ? order : order.slice(0, FEW);
    table.tBodies[0].replaceChildren(...drawn.map((i) => row(i, shown, best.length > 1 ? best[0] : -1, best.length > 1 ? best[best.length - 1] : -1)));
    const left = study.left_out ? `, ${study.left_out} better ones left out` : "";
    document.getElementById("found").textContent = `${order.length} of ${rows.length} cases${left}`;
    const more = document.getElementById("more");
    more.hidden = drawn.length === order.length;
    more.textContent = `Show all ${order.length} rows`;
  }

  function command(text) {
    const code = element("code", {}, text);
    const button = element("button", { type: "button" }, "Copy");
    button.addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(text);
      } catch {
        getSelection().selectAllChildren(code);
        document.execCommand("copy");
      }
      button.textContent = "Copied";
      setTimeout(() => { button.textContent = "Copy"; }, 1500);
    });
    return element("div", { className: "command" }, element("pre", {}, code), button);
  }

  function show(number) {
    const i = rowOf.get(number);
    const place = document.getElementById("case");
    if (i === undefined || !place) return;
    const inputs = study.columns.filter((column) => column.kind === "input");
    const given = inputs.map((column) => `${column.label} ${words(column.values[i], 6)}${unit(column)}`).join(", ");
    const parts = [element("h3", {}, `Case ${number}${given ? `: ${given}` : ""}`)];
    parts.push(element("p", {}, study.status[i] === "completed" ? `Verdict: ${verdict(i)}.` : `${study.status[i]}: ${study.reason[i]}`));
    for (const [name, address] of Object.entries(study.links[i])) parts.push(element("p", {}, element("a", { href: address }, `Open: ${name}`)));
    if (study.status[i] !== "unreachable") {
      const kept = "result file" in study.links[i];
      parts.push(element("p", {}, kept ? "See it in motion (its run was kept):" : "See it in motion (computed again, which gives the same run):"), command(`${study.replay} ${number}`));
      if (study.settings[i] || !inputs.length) parts.push(element("p", {}, "Run it by itself:"), command(`${study.run} ${study.settings[i]}`.trim()));
    }
    const body = element("tbody");
    for (const column of study.columns.filter((one) => one.kind === "metric" && known(one.values[i]))) {
      const cell = element("td", { className: standing(column, column.values[i]) }, `${words(column.values[i])}${unit(column)}`);
      body.append(element("tr", {}, element("th", { scope: "row" }, column.label), cell, element("td", { className: "words" }, column.limit_words ? `${column.limit_words} – ${column.limit_source}` : "")));
    }
    const heads = ["metric", "value", "limit"].map((text, k) => element("th", { scope: "col", className: k === 2 ? "words" : "" }, text));
    if (body.rows.length) parts.push(element("details", {}, element("summary", {}, "All numbers of this case"), element("div", { className: "scroll" }, element("table", {}, element("thead", {}, element("tr", {}, ...heads)), body))));
    place.replaceChildren(...parts);
    place.hidden = false;
    place.scrollIntoView({ block: "nearest" });
    place.focus({ preventScroll: true });
  }

  // Words stand on an axis at whole numbers.
  function dimension(column, i) {
    const values = i.map((k) => column.values[k]);
    const label = `${column.label}${column.unit ? ` [${column.unit}]` : ""}`;
    if (!values.some((value) => typeof value === "string")) return { label, values };
    const names = [...new Set(values)];
    return { label, values: values.map((value) => names.indexOf(value)), tickvals: names.map((_, k) => k), ticktext: names };
  }

  async function drawParallel() {
    if (!parallel) return;
    const column = columns.get(metric);
    const i = ranked().reverse().filter((k) => study.columns.every((one) => one.kind !== "input" || known(one.values[k])));
    const shown = [...study.columns.filter((one) => one.kind === "input" || one.kind === "extreme"), column];
    const values = i.map((k) => column.values[k]);
    const ramp = [[0, "#3b6fb6"], [0.5, "#b9a13f"], [1, "#c1270f"]];
    const scale = column.better === "higher" ? ramp.map(([at], k) => [at, ramp[ramp.length - 1 - k][1]]) : ramp;
    const ink = getComputedStyle(document.body).color;
    const trace = { type: "parcoords", dimensions: shown.map((one) => dimension(one, i)), line: { color: values, colorscale: scale }, labelfont: { size: 11, color: ink }, tickfont: { size: 10, color: ink }, rangefont: { size: 10, color: ink }, labelangle: shown.length > 5 ? -12 : 0 };
    const layout = { height: 400, margin: { l: 90, r: 110, t: 80, b: 24 }, paper_bgcolor: "rgba(0,0,0,0)", font: { color: ink } };
    await Plotly.react(parallel, [trace], layout, { responsive: true, displaylogo: false, displayModeBar: false });
  }

  // Discs of the face are as large as the place allows; where it is narrow their names are left to the hover.
  function figureOf(place) {
    const figure = (study.figures[metric] || {})[place.dataset.figure];
    const scale = Math.min(1, place.clientWidth / 700);
    if (!figure || place.dataset.figure !== "face" || scale === 1) return figure;
    const data = figure.data.map((trace) => ({ ...trace, mode: scale < 0.7 ? "markers" : trace.mode, marker: { ...trace.marker, size: scale * trace.marker.size } }));
    return { ...figure, data, height: Math.max(380, scale * figure.height) };
  }

  async function drawAll() {
    for (const place of document.querySelectorAll("[data-metric-label]")) place.textContent = columns.get(metric).label;
    await drawing.drawAll(figureOf);
    for (const place of document.querySelectorAll("[data-figure]")) {
      if (!place.on || place.dataset.listening) continue;
      place.dataset.listening = "yes";
      place.on("plotly_click", (event) => {
        const number = event.points[0] && event.points[0].customdata;
        if (known(number)) show(number);
      });
    }
    await drawParallel();
    document.documentElement.dataset.drawn = metric;
  }

  if (choice) {
    choice.value = metric;
    choice.addEventListener("change", () => { metric = choice.value; sorting = null; fill(); drawAll(); });
    for (const name of ["find", "level", "everything"]) document.getElementById(name).addEventListener("input", fill);
    document.getElementById("more").addEventListener("click", () => { opened = true; fill(); });
    fill();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawParallel);
    drawAll();
  } else {
    document.documentElement.dataset.drawn = "yes";
  }
})();
