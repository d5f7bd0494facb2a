// Signals drawn over the time that the lanes show: the smallest and the largest value of each column of pixels.

import { $, colour, el, prepared, redraw } from "./dom.js";

const MOST = 200000, LINES = 6;

/** First index of sorted `at` that is not before `t`. */
function first(at, t) {
  let low = 0, high = at.length;
  while (low < high) { const mid = (low + high) >> 1; if (at[mid] < t) low = mid + 1; else high = mid; }
  return low;
}

/** [column, smallest, largest, last] of `values[i0:i1]`, by columns of pixels. */
export function thinned(at, values, i0, i1, column) {
  const out = [];
  for (let i = i0; i < i1; i++) {
    const v = values[i];
    if (v === null || !Number.isFinite(v)) { out.push(null); continue; }
    const c = column(at[i]), had = out.at(-1);
    if (had && had[0] === c) { had[1] = Math.min(had[1], v); had[2] = Math.max(had[2], v); had[3] = v; } else out.push([c, v, v, v]);
  }
  return out;
}

export class Signals {
  constructor(app) {
    Object.assign(this, { app, plots: new Map(), names: [] });
    this.draw = () => { for (const plot of this.plots.values()) this.drawn(plot); };
    $("signal-filter").oninput = () => this.filter();
  }

  list(signals) {
    this.names = signals;
    for (const name of [...this.plots.keys()]) if (!signals.some((s) => s.name === name)) this.turn(name, false);
    $("signals").replaceChildren(...signals.map(({ name, type }) => {
      const button = el("button", { type: "button", "aria-pressed": this.plots.has(name), title: type }, name, el("small", {}, ` ${type}`));
      button.onclick = () => this.turn(name, !this.plots.has(name));
      return el("li", {}, button);
    }));
    this.filter();
    for (const name of this.plots.keys()) this.app.send({ t: "plot", signal: name, on: true });
  }

  filter() {
    const part = $("signal-filter").value.toLowerCase();
    for (const li of $("signals").children) li.hidden = !li.textContent.toLowerCase().includes(part);
  }

  turn(name, on) {
    if (on) {
      const canvas = el("canvas", { role: "img", "aria-label": `plot of ${name}` }), words = el("figcaption");
      const shut = el("button", { type: "button", "aria-label": `close ${name}`, onclick: () => this.turn(name, false) }, "×");
      const figure = el("figure", {}, words, shut, canvas);
      this.plots.set(name, { name, figure, canvas, words, parts: [] });
      $("plots").append(figure);
      figure.scrollIntoView({ block: "nearest" });
    } else { this.plots.get(name)?.figure.remove(); this.plots.delete(name); }
    this.app.send({ t: "plot", signal: name, on });
    for (const b of $("signals").querySelectorAll("button")) if (b.firstChild.textContent === name) b.setAttribute("aria-pressed", on);
  }

  /** Takes a `plot` message: one list of values for each field; the oldest half goes when there are too many. */
  show(message) {
    const plot = this.plots.get(message.signal), slot = message.slot ?? 0;
    if (!plot) return;
    if (!message.more || !plot.parts[slot]) plot.parts[slot] = { at: [], fields: message.fields, values: message.fields.map(() => []) };
    const part = plot.parts[slot];
    for (const t of message.at) part.at.push(t);
    message.values.forEach((column, i) => { for (const v of column) part.values[i]?.push(v); });
    if (part.at.length > MOST) { part.at.splice(0, MOST / 2); for (const v of part.values) v.splice(0, MOST / 2); }
    redraw(this.draw);
  }

  later() { if (this.plots.size) redraw(this.draw); }

  drawn(plot) {
    const [g, w, h] = prepared(plot.canvas), { timeline } = this.app, [a, b] = timeline.view, left = timeline.left ?? 0;
    if (!w) return;
    const x = (t) => left + ((t - a) / (b - a)) * (w - left);
    const lines = plot.parts.flatMap(({ at, fields, values }, slot) => {
      const i0 = Math.max(first(at, a) - 1, 0), i1 = Math.min(first(at, b) + 1, at.length), i = first(at, this.app.now() + 1e-9) - 1;
      return fields.slice(0, LINES).map((field, k) => ({ field: slot ? `${field} ²` : field, slot, series: k, now: values[k][i], line: thinned(at, values[k], i0, i1, (t) => Math.round(x(t))) }));
    });
    let low = Infinity, high = -Infinity;
    for (const { line } of lines) for (const c of line) if (c) { low = Math.min(low, c[1]); high = Math.max(high, c[2]); }
    if (low === high) { low -= 0.5; high += 0.5; }
    const y = (v) => h - 8 - ((v - low) / (high - low)) * (h - 16);
    g.font = "11px system-ui, sans-serif";
    g.fillStyle = colour("soft");
    g.textAlign = "right";
    if (Number.isFinite(low)) { g.fillText(high.toPrecision(4), left - 6, 12); g.fillText(low.toPrecision(4), left - 6, h - 5); }
    g.textAlign = "left";
    g.lineWidth = 1.4;
    for (const { line, series, slot } of lines) {
      g.strokeStyle = colour(`series-${series}`);
      g.setLineDash(slot ? [4, 3] : []);
      g.beginPath();
      let down = false;
      for (const c of line) {
        if (!c) { down = false; continue; }
        if (down) g.lineTo(c[0], y(c[1])); else g.moveTo(c[0], y(c[1]));
        if (c[2] > c[1]) { g.lineTo(c[0], y(c[2])); g.lineTo(c[0], y(c[3])); }
        down = true;
      }
      g.stroke();
    }
    const now = this.app.now();
    g.fillStyle = colour("accent");
    if (now >= a && now <= b) g.fillRect(x(now) - 0.75, 0, 1.5, h);
    const legend = lines.map(({ field, series, now: v }) => { const tag = el("span", {}, Number.isFinite(v) ? `${field} ${Number(v.toPrecision(4))}` : field); tag.style.color = `var(--series-${series})`; return tag; });
    plot.words.replaceChildren(el("b", {}, plot.name), ...legend);
  }
}
