// Progress as it happens: server-sent events, and asking again and again where those do not come through.

const PATIENCE = 2_000;
const PAUSE = 700;

/**
 * Follow a job until it has ended.
 *
 * @param events address of its server-sent events
 * @param ask    gives its record
 * @param tell   is called with every new record
 * @param ended  tells whether a record is the last one
 * @returns a function that stops following
 */
export function follow({events, ask, tell, ended}) {
  let stopped = false;
  let timer = 0;
  let source = null;

  const stop = () => {
    stopped = true;
    clearTimeout(timer);
    source?.close();
  };
  const take = (record) => {
    if (stopped) return;
    if (ended(record)) stop();
    tell(record);
  };
  const poll = async () => {
    if (stopped) return;
    try {
      take(await ask());
    } catch {
      // The server may be starting again; jobs survive that.
    }
    if (!stopped) timer = setTimeout(poll, PAUSE);
  };
  const fallBack = () => {
    source?.close();
    source = null;
    clearTimeout(timer);
    poll();
  };

  if (typeof EventSource === "undefined") {
    fallBack();
    return stop;
  }
  timer = setTimeout(fallBack, PATIENCE);
  source = new EventSource(events);
  const heard = async (event) => {
    clearTimeout(timer);
    const news = JSON.parse(event.data);
    // The last event says that it is over; what came out stands in the record.
    if (event.type === "done") source?.close();
    take(event.type === "done" ? await ask() : news);
  };
  source.addEventListener("progress", heard);
  source.addEventListener("done", heard);
  source.onerror = () => {
    if (!stopped) fallBack();
  };
  return stop;
}
