// The page around Meshcat's viewer: takes a scene, places the camera, writes what must be known, drives the animation.
const SPEEDS = [2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002];
const FIELD_OF_VIEW = 35;
const by = (id) => document.getElementById(id);
const pane = by("meshcat-pane");
let viewer;
try {
  viewer = new MeshCat.Viewer(pane);
} catch (error) {
  by("words").hidden = false;
  by("title").textContent = "This browser shows no 3D pictures: WebGL is switched off or not supported.";
  throw error;
}
const THREE = MeshCat.THREE;
viewer.set_property(["Background"], "top_color", [0.90, 0.93, 0.96]);
viewer.set_property(["Background"], "bottom_color", [0.72, 0.76, 0.80]);
let words = null;
let chosenView = null;
let traces = [];
let held = false;  // stands still while the next version is made
let lastSpeed = null;
let lastState = "";

function show(newWords, buffer) {
  const first = words === null;
  const state = first ? null : {time: viewer.animator.time, playing: viewer.animator.playing || held, speed: mixer().timeScale};
  const [motion, ...commands] = blocksOf(buffer);
  if (!first) for (const root of words.roots) viewer.delete_path([root]);
  words = newWords;
  for (const command of commands) viewer.handle_command_bytearray(command);
  viewer.set_animation(animationsOf(motion), {play: true, repetitions: Infinity});
  const span = words.end - words.start;
  traces = [];
  viewer.scene.traverse((object) => { if (object.isLine && object.parent.name === "now") traces.push(object.geometry); });
  setSpeed(first ? words.speed : state.speed);
  if (!first) {
    viewer.animator.seek(Math.min(state.time, span));
    viewer.animator.display_progress(Math.min(state.time, span));
    if (!state.playing) viewer.animator.pause();
    held = false;
  }
  by("slider").max = span;
  write();
  keepPrograms();
  if (first) {
    by("words").hidden = by("bar").hidden = false;
    prepareScene();
    look(words.view);
    // Beside key numbers there is little room.
    by("legend").open = !words.values && window.innerHeight > 480;
  }
  viewer.set_dirty();
}

// WebGL programs live as long as a material uses them. A speck of every kind keeps them alive while a machine is
// replaced by another, which would otherwise wait for all of them to be compiled again.
const kept = new Map();
function keepPrograms() {
  viewer.scene.traverse((object) => {
    const {material} = object;
    if (!material || Array.isArray(material) || object.userData.speck) return;
    const kind = `${object.type} ${material.type} ${material.side} ${material.vertexColors}`;
    if (kept.has(kind)) return;
    const speck = object.clone(false);
    speck.geometry = object.geometry.clone();
    speck.material = material.clone();
    speck.material.needsUpdate = true;
    speck.userData = {speck: true};
    speck.scale.setScalar(1e-9);
    speck.position.set(0, 0, 0);
    speck.frustumCulled = false;
    kept.set(kind, speck);
  });
  for (const speck of kept.values()) viewer.scene.add(speck);
}

function mixer() { return viewer.animator.mixer; }

function setSpeed(speed) {
  mixer().timeScale = speed;
  const folder = viewer.animator.folder.__folders["default"];
  if (folder) for (const control of folder.__controllers) if (control.property === "timeScale") control.updateDisplay();
}

function prepareScene() {
  // The lamps stand a few metres from the origin and reach no farther; a machine is lit from afar.
  for (const lamp of ["PointLightNegativeX", "PointLightPositiveX"]) {
    viewer.set_property(["Lights", lamp, "<object>"], "distance", 0);
    viewer.scene_tree.find(["Lights", lamp]).object.scale.setScalar(Math.max(1, words.size));
  }
  const camera = viewer.camera;
  camera.fov = FIELD_OF_VIEW;
  camera.near = 0.002 * words.size;
  camera.far = 60 * words.size;
  // Meshcat's grid has squares of half a metre, and its axes are as long.
  for (const name of ["Grid", "Axes"]) viewer.scene_tree.find([name, "<object>"]).object.scale.setScalar(words.grid / 0.5);
  viewer.set_property(["Lights", "AmbientLight", "<object>"], "intensity", 0.42);
  viewer.gui.close();
}

// Puts the camera where the view's box just fills the picture right of the words.
function look(name) {
  const view = words.views[name] || Object.values(words.views)[0];
  chosenView = name;
  const toward = new THREE.Vector3(...view.direction).normalize();
  const forward = toward.clone().negate();
  const right = new THREE.Vector3().crossVectors(forward, new THREE.Vector3(0, 0, 1)).normalize();
  const up = new THREE.Vector3().crossVectors(right, forward);
  const low = new THREE.Vector3(...view.low), high = new THREE.Vector3(...view.high);
  const middle = low.clone().add(high).multiplyScalar(0.5);
  const tall = Math.tan(FIELD_OF_VIEW * Math.PI / 360);
  const width = pane.offsetWidth, height = pane.offsetHeight || window.innerHeight;
  const hidden = width > 700 && !by("words").hidden ? 310 / width : 0;
  const wide = tall * width / height;
  // The middle of the free part of the picture lies `hidden` to the right and `raised` above that of the whole.
  const raised = 0.05;
  let distance = 0;
  for (let i = 0; i < 8; i++) {
    const corner = new THREE.Vector3(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z).sub(middle);
    const depth = corner.dot(toward);
    const beside = Math.abs(corner.dot(right)) / wide + depth * (depth > 0 ? 1 : 1 - 2 * hidden);
    const above = Math.abs(corner.dot(up)) / tall + depth * (depth > 0 ? 1 : 0.84);
    distance = Math.max(distance, beside / (1 - hidden), above / 0.89);
  }
  distance *= 1.03;
  middle.addScaledVector(right, -hidden * distance * wide);
  middle.addScaledVector(up, -raised * distance * tall);
  // Camera and target are set in the viewer's own axes, y up.
  const place = middle.clone().addScaledVector(toward, distance);
  viewer.controls.target.set(middle.x, middle.z, -middle.y);
  viewer.camera.position.set(place.x, place.z, -place.y);
  viewer.controls.update();
  viewer.camera.updateProjectionMatrix();
  for (const button of by("views").children) button.classList.toggle("chosen", button.textContent === name);
  viewer.set_dirty();
}

function paragraph(text, kind) {
  const p = document.createElement("p");
  p.textContent = text;
  if (kind) p.className = kind;
  return p;
}

function write() {
  document.title = words.title;
  by("title").textContent = words.title;
  writeSentences();
  by("keys").replaceChildren(...words.keys.map(keyRow));
  by("notes").replaceChildren(...words.notes.map((note) => paragraph(note)));
  by("views").replaceChildren(...Object.keys(words.views).map((name) => {
    const button = document.createElement("button");
    button.textContent = name;
    button.onclick = () => look(name);
    button.classList.toggle("chosen", name === chosenView);
    return button;
  }));
  by("values").innerHTML = words.values || "";
  lastSpeed = null;  // the choice is written anew below and has to be made again
  const speeds = [...new Set([...SPEEDS, words.speed])].sort((a, b) => b - a);
  by("speed").replaceChildren(...speeds.map((speed) => new Option(speed === 1 ? "real time" : `× ${speed}`, speed)));
}

// The second sentence tells the speed, which the reader may change.
function writeSentences() {
  const speed = mixer().timeScale;
  const [scale, asBuilt, ...others] = words.sentences;
  const found = [paragraph(scale)];
  if (speed === words.speed) found.push(paragraph(asBuilt));
  else {
    const seen = words.fastest > 0 && speed !== 1 ? `: ${rounded(words.fastest)} Hz is seen as ${rounded(words.fastest * speed)} Hz` : "";
    found.push(paragraph(speed === 1 ? "Real time." : `${rounded(speed)} × real time${seen}.`));
  }
  if (words.fastest * speed > 15 && words.step * words.fastest < 0.25) found.push(paragraph(
    `${rounded(words.fastest)} Hz at this speed is faster than a screen can show; what seems to move there is not the machine's motion. Choose a lower speed.`, "doubt"));
  found.push(...others.map((text) => paragraph(text)));
  by("sentences").replaceChildren(...found);
}

function rounded(value) { return Number(value.toPrecision(3)).toString(); }

function keyRow(key) {
  const row = document.createElement("div");
  row.className = "key";
  const [colour] = key.colours;
  const id = `scale-${Math.random().toString(36).slice(2)}`;
  const stops = key.colours.map((c, i) => `<stop offset="${i / Math.max(1, key.colours.length - 1)}" stop-color="${c}"/>`).join("");
  const marks = {
    arrow: `<path d="M1 6h20v-4l12 5-12 5v-4h-20z" fill="${colour}"/>`,
    line: `<path d="M1 9q8-12 16-3t16-3" stroke="${colour}" stroke-width="2" fill="none"/>`,
    grid: `<path d="M1 4h32M1 10h32M8 1v12M17 1v12M26 1v12" stroke="${colour}" fill="none"/>`,
    patch: `<rect x="1" y="1" width="32" height="12" fill="${colour}"/>`,
    scale: `<defs><linearGradient id="${id}">${stops}</linearGradient></defs><rect x="1" y="1" width="32" height="12" fill="url(#${id})"/>`,
  };
  row.innerHTML = `<svg width="34" height="14">${marks[key.mark]}</svg>`;
  const text = document.createElement("span");
  text.textContent = key.text;
  row.append(text);
  return row;
}

function toggle() {
  if (viewer.animator.playing) viewer.animator.pause();
  else viewer.animator.play();
}

function seek(time) {
  viewer.animator.seek(time);
  viewer.animator.display_progress(time);
}

by("play").onclick = toggle;
by("slider").oninput = (event) => seek(Number(event.target.value));
by("speed").onchange = (event) => setSpeed(Number(event.target.value));
window.addEventListener("keydown", (event) => {
  if (event.code === "Space" && !["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName)) { event.preventDefault(); toggle(); }
});

function drawTraces() {
  const now = Math.round(viewer.animator.time / words.step);
  const from = Math.max(0, now - words.tail);
  for (const trace of traces) trace.setDrawRange(from, now - from + 1);
}

function follow() {
  requestAnimationFrame(follow);
  if (!words) return;
  const {animator} = viewer;
  drawTraces();
  const state = `${animator.playing} ${animator.time} ${words.end}`;
  if (state !== lastState) {
    // A page that is written anew sixty times a second costs as much as the picture.
    lastState = state;
    by("play").textContent = animator.playing ? "❚❚" : "▶";
    by("slider").value = animator.time;
    by("time").textContent = `${(words.start + animator.time).toFixed(3)} of ${rounded(words.end)} s`;
  }
  const speed = mixer().timeScale;
  if (speed !== lastSpeed) {
    lastSpeed = speed;
    const known = Array.from(by("speed").options).find((option) => Number(option.value) === speed);
    by("speed").value = known ? known.value : "";
    writeSentences();
  }
}
requestAnimationFrame(follow);

function say(text, mild) {
  by("banner").hidden = !text;
  by("banner").textContent = text || "";
  by("banner").classList.toggle("mild", Boolean(mild));
}

// Without a graphics card the picture takes the processor from the simulation one waits for.
function hold(still) {
  if (still && viewer.animator.playing) {
    held = true;
    viewer.animator.pause();
  } else if (!still && held) {
    held = false;
    viewer.animator.play();
  }
}

function follow_server() {
  const events = new EventSource("events");
  events.addEventListener("scene", async () => { show(...await fetched()); say(""); });
  events.addEventListener("trouble", (event) => { say(JSON.parse(event.data)); hold(false); });
  events.addEventListener("busy", (event) => { say(JSON.parse(event.data), true); hold(true); });
  events.onerror = () => say("The server has stopped: what is loaded still plays.", true);
}

window.replay = {viewer, look, seek, get words() { return words; }, ready: start()};

async function start() {
  const embedded = by("scene-words");
  const query = new URLSearchParams(location.search);
  if (embedded) show(JSON.parse(embedded.textContent), await unpacked(by("scene-bytes").textContent));
  else if (query.has("film")) {
    show(...await fetched());
    await film(query);
  }
  else follow_server();
}
