"use strict";
// Draws the figures with plotly.js in the colours of the page's theme, and filters the table of parameters.
(() => {
  const LIGHT = { INK: "#16202b", BLUE: "#0072b2", VERMILION: "#d55e00", GREEN: "#009e73", PURPLE: "#cc79a7", ORANGE: "#e69f00", SKY: "#56b4e9", GREY: "#8a8a8a", text: "#16202b", grid: "#e3e8ed", paper: "rgba(255,255,255,0.8)" };
  const DARK = { INK: "#e6ebf0", BLUE: "#58b0e8", VERMILION: "#f08a4b", GREEN: "#3cc79b", PURPLE: "#e59ac4", ORANGE: "#f3b941", SKY: "#8fd0f5", GREY: "#9aa5b1", text: "#e6ebf0", grid: "#2b343e", paper: "rgba(22,27,34,0.8)" };
  // What fits on a page with title and caption.
  const PRINT_WIDTH = 690;
  const PRINT_HEIGHT = 840;
  const figures = JSON.parse(document.getElementById("figure-data").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let printing = false;

  const palette = () => (dark.matches && !printing ? DARK : LIGHT);

  function coloured(figure) {
    const colours = palette();
    const data = figure.data.map((trace) => {
      const colour = colours[trace.meta.ink];
      return trace.type === "bar"
        ? { ...trace, marker: { color: colour } }
        : { ...trace, line: { ...trace.line, color: colour } };
    });
    const layout = { ...figure.layout };
    for (const key of Object.keys(layout)) {
      if (/^[xy]axis\d*$/.test(key)) {
        layout[key] = { gridcolor: colours.grid, linecolor: colours.GREY, zeroline: false, showline: true, ticks: "outside", ticklen: 3, tickcolor: colours.GREY, automargin: false, ...layout[key] };
      }
    }
    layout.shapes = layout.shapes.map((shape) => ({
      ...shape,
      ...(shape.fillcolor ? { fillcolor: colours[shape.fillcolor] } : {}),
      line: { ...shape.line, ...(shape.line.color ? { color: colours[shape.line.color] } : {}) },
    }));
    layout.annotations = layout.annotations.map((words) => ({
      ...words,
      ...(words.bgcolor ? { bgcolor: colours.paper } : {}),
      font: { size: 12, color: colours.text },
    }));
    return {
      data,
      layout: {
        ...layout,
        height: figure.height,
        paper_bgcolor: "rgba(0,0,0,0)",
        plot_bgcolor: "rgba(0,0,0,0)",
        font: { family: "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif", size: 12, color: colours.text },
        legend: { orientation: "h", x: 1, xanchor: "right", y: 1, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)" },
        modebar: { bgcolor: "rgba(0,0,0,0)", color: colours.GREY, activecolor: colours.INK },
        dragmode: "zoom",
        bargap: 0.1,
      },
    };
  }

  const config = { responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "", modeBarButtonsToRemove: ["select2d", "lasso2d", "sendDataToCloud"] };

  async function drawAll() {
    for (const place of document.querySelectorAll("[data-figure]")) {
      const { data, layout } = coloured(figures[place.dataset.figure]);
      await Plotly.newPlot(place, data, layout, config);
      // Let the page answer between two figures.
      await new Promise((resume) => setTimeout(resume));
    }
    document.documentElement.dataset.drawn = "yes";
  }

  function recolour() {
    for (const place of document.querySelectorAll("[data-figure]")) {
      if (!place._fullLayout) continue;
      const { data, layout } = coloured(figures[place.dataset.figure]);
      data.forEach((trace, i) => { trace.visible = place.data[i].visible ?? true; });
      if (printing) {
        layout.width = PRINT_WIDTH;
        layout.height = Math.min(0.75 * layout.height, PRINT_HEIGHT);
      }
      Plotly.react(place, data, layout, config);
      if (!printing) Plotly.Plots.resize(place);
    }
  }

  dark.addEventListener("change", recolour);
  addEventListener("beforeprint", () => { printing = true; recolour(); });
  addEventListener("afterprint", () => { printing = false; recolour(); });

  const table = document.getElementById("parameter-table");
  if (table) {
    const find = document.getElementById("find");
    const assumed = document.getElementById("only-assumed");
    const changed = document.getElementById("only-changed");
    const rows = [...table.tBodies[0].rows].map((row) => ({ row, text: row.textContent.toLowerCase() }));
    const filter = () => {
      const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      for (const { row, text } of rows) {
        const kept = words.every((word) => text.includes(word)) && (!assumed.checked || row.classList.contains("assumed")) && (!changed.checked || row.classList.contains("changed"));
        row.hidden = !kept;
        shown += kept;
      }
      document.getElementById("found").textContent = `${shown} shown`;
    };
    for (const control of [find, assumed, changed]) control.addEventListener("input", filter);
  }

  drawAll();
})();
