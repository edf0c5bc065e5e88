"use strict";
// Draws figures with plotly.js in the colours of the page's theme, on screen and on paper.
const drawing = (() => {
  const LIGHT = { INK: "#16202b", BLUE: "#0072b2", VERMILION: "#d55e00", GREEN: "#009e73", PURPLE: "#cc79a7", ORANGE: "#e69f00", SKY: "#56b4e9", GREY: "#8a8a8a", text: "#16202b", grid: "#e3e8ed", paper: "rgba(255,255,255,0.8)" };
  const DARK = { INK: "#e6ebf0", BLUE: "#58b0e8", VERMILION: "#f08a4b", GREEN: "#3cc79b", PURPLE: "#e59ac4", ORANGE: "#f3b941", SKY: "#8fd0f5", GREY: "#9aa5b1", text: "#e6ebf0", grid: "#2b343e", paper: "rgba(22,27,34,0.8)" };
  // What fits on a page with title and caption.
  const PRINT_WIDTH = 690;
  const PRINT_HEIGHT = 840;
  const places = () => document.querySelectorAll("[data-figure]");
  // Gives the figure that belongs into a place, or nothing.
  let figureOf = () => null;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let printing = false;

  const palette = () => (dark.matches && !printing ? DARK : LIGHT);

  function coloured(figure) {
    const colours = palette();
    const data = figure.data.map((trace) => {
      if (!trace.meta || !trace.meta.ink) return trace;
      const colour = colours[trace.meta.ink];
      const inked = { ...trace, marker: { ...trace.marker, color: colour } };
      if (trace.type !== "bar") inked.line = { ...trace.line, color: colour };
      if (trace.meta.shade) inked.fillcolor = `${colour}30`;
      return inked;
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

  async function draw(place) {
    const figure = figureOf(place);
    place.closest("figure").hidden = !figure;
    if (!figure) return;
    const { data, layout } = coloured(figure);
    await Plotly.react(place, data, layout, config);
  }

  async function drawAll(lookup) {
    figureOf = lookup;
    for (const place of places()) {
      await draw(place);
      // Let the page answer between two figures.
      await new Promise((resume) => setTimeout(resume));
    }
    document.documentElement.dataset.drawn = "yes";
  }

  function recolour() {
    for (const place of places()) {
      if (!place._fullLayout || !figureOf(place)) continue;
      const { data, layout } = coloured(figureOf(place));
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

  return { drawAll };
})();
