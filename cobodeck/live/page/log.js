// The log: what happened, the newest last; and where a shadow decided otherwise.

import { $, button, el, redraw, seconds, short } from "./dom.js";

const LINES = 300;

export class Log {
  constructor(app) { Object.assign(this, { app, newest: -1 }); }

  /** A new run or record: what the log has stays, as it was said; differences are told anew. */
  begin() {
    $("shadow").replaceChildren();
    $("shadow-box").hidden = true;
  }

  line(text, kind = "") { append($("log"), el("li", { className: kind }, text)); }

  /** Something that happened; of two records, with which of them says so. */
  add({ at, kind, path, text }, slot = 0) {
    this.newest = at;
    const told = `${this.of(slot)}${seconds(at)} ${path ? `${path}: ` : ""}${text || kind}`;
    this.line(told, /error|fault|stop/.test(kind) ? "error" : "");
  }

  of(slot) {
    const { runs = [] } = this.app.hello;
    return runs.length > 1 ? `${runs[slot].title} ` : "";
  }

  /** What a state has that was not said yet; after a run that began anew, all of it. */
  news({ at, last }) {
    const since = at < this.newest ? -1 : this.newest;
    for (const entry of last) if (entry.at > since) this.add(entry);
  }

  /** What the records say of the present instant, in the order of time. */
  anew() {
    $("log").replaceChildren();
    const all = this.app.states.flatMap(({ last = [] }, slot) => last.map((entry) => [entry, slot]));
    for (const one of all.sort(([a], [b]) => a.at - b.at)) this.add(...one);
  }

  /** Lists where a shadow decided otherwise, and marks it on the lanes. */
  differed({ rows, more, slot = 0 }) {
    if (!more) for (const old of $("shadow").querySelectorAll(`[data-slot="${slot}"]`)) old.remove();
    const marks = rows.map(({ at, path, ran, shadow }) => {
      const show = () => { this.app.timeline.seek(at); this.app.goTo(path, slot); };
      const text = short(`ran ${ran}, shadow ${shadow}`);
      append($("shadow"), el("li", { "data-slot": slot },
        button(`${this.of(slot)}${seconds(at)} ${path || "the chart"}`, show), el("span", {}, text)));
      return { at, kind: "shadow", text: `${path}: ${text}` };
    });
    this.app.timeline.mark(marks, slot);
    $("shadow-box").hidden = !$("shadow").children.length;
  }
}

const atEnd = new Map();  // of lists that got items since the last frame: whether they stay at their end

/** Adds to a list, of which the oldest go; at its end it stays there. */
function append(list, item) {
  if (!atEnd.has(list)) atEnd.set(list, list.scrollHeight - list.scrollTop - list.clientHeight < 30);
  list.append(item);
  while (list.children.length > LINES) list.firstChild.remove();
  redraw(scrolled);
}

/** Once in a frame: to ask for heights has the whole page laid out. */
function scrolled() {
  for (const [list, end] of atEnd) if (end) list.scrollTop = list.scrollHeight;
  atEnd.clear();
}
