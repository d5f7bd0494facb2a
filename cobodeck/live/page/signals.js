// Signals drawn over the time that the lanes show: the smallest and the largest value of each column of pixels.

import { $, button, colour, el, prepared, redraw } from "./dom.js";

const MOST = 200000, LINES = 6;

/** First index of sorted `at` that is not before `t`. */
function first(at, t) {
  let low = 0, high = at.length;
  while (low < high) {
    const mid = (low + high) >> 1;
    if (at[mid] < t) low = mid + 1; else high = mid;
  }
  return low;
}

/** [column, smallest, largest, last] of `values[i0:i1]`, by columns of pixels; null where there is no number. */
function thinned(at, values, i0, i1, column) {
  const out = [];
  for (let i = i0; i < i1; i++) {
    const v = values[i], had = out.at(-1), c = column(at[i]);
    if (v === null || !Number.isFinite(v)) out.push(null);
    else if (had && had[0] === c) had.splice(1, 3, Math.min(had[1], v), Math.max(had[2], v), v);
    else out.push([c, v, v, v]);
  }
  return out;
}

export class Signals {
  constructor(app) {
    Object.assign(this, { app, plots: new Map() });
    this.draw = () => { for (const plot of this.plots.values()) this.drawn(plot); };
    $("signal-filter").oninput = () => this.filter();
  }

  /** The signals of a run; what is plotted and there again is asked for again. */
  list(signals) {
    for (const name of this.plots.keys()) {
      if (signals.some((s) => s.name === name)) this.app.send({ t: "plot", signal: name, on: true });
      else this.turn(name, false);
    }
    $("signals").replaceChildren(...signals.map(({ name, type }) => {
      const told = [name, el("small", {}, ` ${type}`)];
      const turn = () => this.turn(name, !this.plots.has(name));
      return el("li", {}, button(told, turn, { "aria-pressed": this.plots.has(name), "data-name": name }));
    }));
    this.filter();
  }

  filter() {
    const part = $("signal-filter").value.toLowerCase();
    for (const li of $("signals").children) li.hidden = !li.textContent.toLowerCase().includes(part);
  }

  turn(name, on) {
    if (on) this.add(name);
    else {
      this.plots.get(name)?.figure.remove();
      this.plots.delete(name);
    }
    this.app.send({ t: "plot", signal: name, on });
    const own = [...$("signals").querySelectorAll("button")].find((b) => b.dataset.name === name);
    own?.setAttribute("aria-pressed", on);
  }

  add(name) {
    const canvas = el("canvas", { role: "img", "aria-label": `plot of ${name}` }), words = el("figcaption");
    const shut = button("×", () => this.turn(name, false), { "aria-label": `close ${name}` });
    const figure = el("figure", {}, words, shut, canvas);
    this.plots.set(name, { name, figure, canvas, words, parts: [] });
    $("plots").append(figure);
    figure.scrollIntoView({ block: "nearest" });
  }

  /** Takes a `plot` message: one list of values for each field; the oldest half goes when there are too many. */
  show({ signal, slot = 0, more, at, fields, values }) {
    const plot = this.plots.get(signal);
    if (!plot) return;
    if (!more || !plot.parts[slot]) plot.parts[slot] = { at: [], fields, values: fields.map(() => []) };
    const part = plot.parts[slot];
    part.at = part.at.concat(at);
    part.values = part.values.map((column, i) => column.concat(values[i] ?? []));
    if (part.at.length > MOST) {
      part.at.splice(0, MOST / 2);
      for (const column of part.values) column.splice(0, MOST / 2);
    }
    this.later();
  }

  later() { if (this.plots.size) redraw(this.draw); }

  drawn(plot) {
    const [g, w, h] = prepared(plot.canvas), { timeline } = this.app, now = this.app.now();
    if (!w) return;
    const [a, b] = timeline.view, left = timeline.left ?? 0, x = (t) => left + ((t - a) / (b - a)) * (w - left);
    const lines = plot.parts.flatMap((part, slot) => this.lines(part, slot, a, b, (t) => Math.round(x(t))));
    const seen = lines.flatMap(({ line }) => line).filter(Boolean);
    let low = seen.reduce((least, c) => Math.min(least, c[1]), Infinity);
    let high = seen.reduce((most, c) => Math.max(most, c[2]), -Infinity);
    if (low === high) { low -= 0.5; high += 0.5; }
    const y = (v) => h - 8 - ((v - low) / (high - low)) * (h - 16);
    g.font = "11px system-ui, sans-serif";
    g.fillStyle = colour("soft");
    g.textAlign = "right";
    if (seen.length) {
      g.fillText(high.toPrecision(4), left - 6, 12);
      g.fillText(low.toPrecision(4), left - 6, h - 5);
    }
    g.lineWidth = 1.4;
    for (const { line, series, slot } of lines) {
      g.strokeStyle = colour(`series-${series}`);
      g.setLineDash(slot ? [4, 3] : []);
      this.stroke(g, line, y);
    }
    g.fillStyle = colour("accent");
    if (now >= a && now <= b) g.fillRect(x(now) - 0.75, 0, 1.5, h);
    plot.words.replaceChildren(el("b", {}, plot.name), ...lines.map(({ field, series, now: v }) => {
      const word = el("span", {}, Number.isFinite(v) ? `${field} ${Number(v.toPrecision(4))}` : field);
      word.style.color = `var(--series-${series})`;
      return word;
    }));
  }

  /** The first fields of a signal, each as what is to be drawn between `a` and `b`, and its value now. */
  lines({ at, fields, values }, slot, a, b, column) {
    const i0 = Math.max(first(at, a) - 1, 0), i1 = Math.min(first(at, b) + 1, at.length);
    const i = first(at, this.app.now() + 1e-9) - 1;
    return fields.slice(0, LINES).map((field, series) => ({
      field: slot ? `${field} ²` : field, slot, series, now: values[series][i],
      line: thinned(at, values[series], i0, i1, column),
    }));
  }

  stroke(g, line, y) {
    let down = false;
    g.beginPath();
    for (const column of line) {
      if (column) {
        const [x, low, high, last] = column;
        if (down) g.lineTo(x, y(low)); else g.moveTo(x, y(low));
        if (high > low) { g.lineTo(x, y(high)); g.lineTo(x, y(last)); }
      }
      down = Boolean(column);
    }
    g.stroke();
  }
}
