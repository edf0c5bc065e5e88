// For a film: every picture is drawn, the words are written into it, and it is handed to the server.
async function film(query) {
  const count = Number(query.get("film")), rate = Number(query.get("rate"));
  const width = Number(query.get("width")), height = Number(query.get("height"));
  by("words").hidden = by("bar").hidden = true;
  viewer.animator.pause();
  viewer.renderer.setPixelRatio(1);
  pane.style.cssText = `width: ${width}px; height: ${height}px; inset: auto`;
  viewer.set_3d_pane_size(width, height);
  look(words.view);
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const paper = canvas.getContext("2d");
  for (let i = 0; i < count; i++) {
    seek(Math.min(i / rate * words.speed, words.end - words.start));
    drawTraces();
    viewer.render();
    paper.drawImage(viewer.renderer.domElement, 0, 0, width, height);
    writeOn(paper, width, height);
    const picture = await new Promise((done) => canvas.toBlob(done, "image/jpeg", 0.93));
    await fetch("frame", {method: "POST", body: picture});
  }
}

function writeOn(paper, width, height) {
  const top = height - 22 * words.sentences.length - 34;
  paper.fillStyle = "rgba(255, 255, 255, .82)";
  paper.fillRect(0, top, width, height - top);
  paper.fillStyle = "#1c2530";
  paper.font = "bold 16px system-ui, sans-serif";
  paper.fillText(words.title, 14, top + 22);
  paper.fillText(`t = ${(words.start + viewer.animator.time).toFixed(3)} s`, width - 130, top + 22);
  paper.font = "15px system-ui, sans-serif";
  words.sentences.forEach((text, i) => paper.fillText(text, 14, top + 44 + 22 * i));
}
