"use strict";
// Draws the figures of a run and filters the table of its parameters.
(() => {
  const figures = JSON.parse(document.getElementById("figure-data").textContent);
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

  drawing.drawAll((place) => figures[place.dataset.figure]);
})();
