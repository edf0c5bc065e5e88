// Which view stands behind which address. Addresses are hashes, so that the server has one page and no rewriting.

const routes = [];
let leave = () => {};
let turn = 0;

/** Show `view(context, ...parts)` for addresses such as `/runs/:id`. */
export function route(pattern, view) {
  const expression = new RegExp(`^${pattern.replace(/:\w+/g, "([^/]+)")}$`);
  routes.push({expression, view});
}

/** Go to an address. */
export function go(address) {
  if (location.hash === `#${address}`) show();
  else location.hash = address;
}

/** The part behind the question mark of the address. */
export function query() {
  return new URLSearchParams(location.hash.split("?")[1] ?? "");
}

/** Where the reader is, without the question. */
export function place() {
  return location.hash.slice(1).split("?")[0] || "/";
}

/** Follow the address bar from now on. `frame` gets the view's node, or the problem it met. */
export function startRouting(frame) {
  const render = () => show(frame);
  window.addEventListener("hashchange", () => {
    if (location.hash === "" || location.hash.startsWith("#/")) render();
  });
  show.frame = frame;
  render();
}

/** Show the current address anew. */
export async function show(frame = show.frame) {
  leave();
  turn += 1;
  const mine = turn;
  const ends = [];
  // What a view starts it ends when the reader leaves; what comes back too late is not shown.
  const context = {alive: () => mine === turn, atEnd: (action) => ends.push(action), signal: new AbortController()};
  context.atEnd(() => context.signal.abort());
  leave = () => ends.forEach((action) => action());
  const found = routes.map(({expression, view}) => ({view, match: expression.exec(place())})).find(({match}) => match);
  try {
    const node = found ? await found.view(context, ...found.match.slice(1).map(decodeURIComponent)) : null;
    if (context.alive()) frame.show(node);
  } catch (problem) {
    if (context.alive()) frame.fail(problem);
  }
}
