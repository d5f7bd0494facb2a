// Lanes over time with marks; the slider, playing, and a range for figures. A second record has lanes below the first.

import { $, colour, el, prepared, redraw, seconds } from "./dom.js";
import { nameOf } from "./picture.js";

const NOW_S = 0.2;  // so near to the newest instant a run is looked at as it is now
const ROW = 18, TOP = 20, SEEK_MS = 60, SHORTEST_S = 0.05;
const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];
const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120, 300, 600, 1800, 3600, 7200];
const BAD_END = /error|fail|lost|fault|timeout|stuck|blocked/, BAD_MARK = /stop|fault|miss|late|error/;
const MARKS = { request: "c-deep", escape: "c-escape" };

const clamped = (v, low, high) => Math.min(Math.max(v, low), high);

export class Timeline {
  constructor(app) {
    Object.assign(this, { app, canvas: $("lanes"), sets: [], window: null, range: null, hits: [], left: 0 });
    Object.assign(this, { speed: 1, playing: false, sought: 0, asking: 0, moves: new Set() });
    this.draw = () => this.drawn();
    $("speed").append(...SPEEDS.map((s) => el("option", { value: s }, `${s}×`)));
    $("speed").value = this.speed;
    $("speed").onchange = () => {
      this.speed = Number($("speed").value);
      if (app.live) app.command("speed", { speed: this.speed });
      else if (this.playing) this.play(true);
    };
    $("play").onclick = () => this.play(!this.playing);
    $("previous").onclick = () => this.step(-1);
    $("next").onclick = () => this.step(1);
    $("to-now").onclick = () => this.now();
    $("slider").oninput = () => this.seek(Number($("slider").value));
    $("range-clear").onclick = () => this.take(null);
    this.pointer();
    this.canvas.onkeydown = (e) => this.key(e);
    new ResizeObserver(() => redraw(this.draw)).observe($("lanes-box"));
  }

  get to() { return Math.max(0, ...this.sets.map((s) => s.to), this.app.newest); }
  get view() { return this.window ?? [0, Math.max(this.to, 0.1)]; }

  /** Takes a `lanes` message, or what `lanes+` adds; a span with a known start is the same one, grown. */
  show({ slot = 0, lanes, marks, to }, more) {
    const set = more && this.sets[slot] || { lanes: new Map(), marks: [], to };
    this.sets[slot] = set;
    for (const lane of lanes) {
      if (!set.lanes.has(lane.path)) set.lanes.set(lane.path, { ...lane, spans: [] });
      const { spans } = set.lanes.get(lane.path);
      for (const span of lane.spans) {
        const last = spans.at(-1), grown = last && last[0] === span[0] && last[1] === null;
        spans.splice(grown ? -1 : spans.length, grown ? 1 : 0, span);
      }
    }
    set.marks.push(...marks);
    set.to = Math.max(set.to, to);
    redraw(this.draw);
  }

  /** Takes marks that come after the lanes. */
  mark(marks, slot) {
    this.sets[slot]?.marks.push(...marks);
    redraw(this.draw);
  }

  /** Before a new run or record. */
  clear() {
    Object.assign(this, { sets: [], window: null, range: null, moves: new Set() });
    this.tellRange();
    redraw(this.draw);
  }

  // -- playing and seeking

  playingAt(speed) {
    this.playing = speed > 0;
    if (SPEEDS.includes(speed)) $("speed").value = this.speed = speed;
    $("play").textContent = this.playing ? "pause" : "play";
  }

  play(on) {
    if (on && this.app.now() > this.to - 1e-6) this.app.send({ t: "seek", at: 0 });  // again from the start
    this.playingAt(on ? this.speed : 0);
    this.app.send({ t: "play", speed: on ? this.speed : 0 });
  }

  /** Asks for the moment `at`; of what is asked at about the same time, for the last. */
  seek(at) {
    const { app } = this;
    if (app.live && at >= app.newest - NOW_S) { this.now(); return; }
    if (!app.live && !app.recorded) return;
    app.back = app.live;
    app.at = this.sought = clamped(at, 0, this.to);
    redraw(app.shown);
    this.asking ||= setTimeout(() => { this.asking = 0; this.app.send({ t: "seek", at: this.sought }); }, SEEK_MS);
  }

  /** Back to what a run is now. */
  now() {
    if (!this.app.back) return;
    this.app.back = false;
    clearTimeout(this.asking);
    this.asking = 0;
    this.app.send({ t: "seek", at: null });
    redraw(this.app.shown);
  }

  /** Transitions of a run that goes on, in order, s: those that were told, before them those of lanes. */
  seen() {
    const lanes = [...this.sets[0]?.lanes.values() ?? []];
    const ends = lanes.flatMap(({ spans }) => spans.flatMap((span) => span.slice(0, 2)));
    return [...new Set([...ends, ...this.moves])].filter((at) => at !== null).sort((a, b) => a - b);
  }

  step(way) {
    const now = this.app.now(), moves = this.app.hello.moves ?? this.seen();
    const at = way > 0 ? moves.find((t) => t > now + 1e-6) : moves.findLast((t) => t < now - 1e-6);
    if (at !== undefined) this.seek(at);
  }

  // -- ranges

  /** Asks for the figures of a range, `null`: of all. */
  take(range) {
    const [from, to] = range ?? [0, this.to];
    this.range = range;
    this.app.send({ t: "range", from, to });
    this.tellRange();
    redraw(this.draw);
  }

  tellRange() {
    const shown = this.range ?? this.window;
    $("range-clear").hidden = !shown;
    $("range-text").textContent = shown ? shown.map(seconds).join(" – ") : "";
  }

  edge(which) {
    const range = [...(this.range ?? [0, this.to])];
    range[which] = this.app.now();
    if (range[0] > range[1]) range[1 - which] = which ? 0 : this.to;
    this.take(range);
  }

  zoom(factor, at = this.app.now()) {
    const [a, b] = this.view, from = at - (at - a) * factor, to = at + (b - at) * factor;
    if (to - from < SHORTEST_S) return;
    const whole = from <= 0 && to >= this.to;
    this.window = whole ? null : [Math.max(from, 0), Math.min(to, this.to)];
    this.tellRange();
    redraw(this.draw);
  }

  shift(share) {
    const [a, b] = this.view, by = clamped((b - a) * share, -a, this.to - b);
    this.window = [a + by, b + by];
    this.tellRange();
    redraw(this.draw);
  }

  whole() {
    this.window = null;
    this.tellRange();
    redraw(this.draw);
  }

  pointer() {
    const { canvas } = this;
    let start = null;
    const dragged = (e) => start && Math.abs(e.clientX - start.x) > 4;
    const time = (e) => {
      const [a, b] = this.view, box = canvas.getBoundingClientRect();
      return a + ((e.clientX - box.x - this.left) / (box.width - this.left)) * (b - a);
    };
    canvas.onpointerdown = (e) => {
      start = { x: e.clientX, at: time(e) };
      canvas.setPointerCapture(e.pointerId);
    };
    canvas.onpointermove = (e) => {
      if (!dragged(e)) { this.hover(e.offsetX, e.offsetY); return; }
      this.range = [start.at, time(e)].sort((a, b) => a - b);
      redraw(this.draw);
    };
    canvas.onpointerup = (e) => {
      if (dragged(e)) this.take(this.range.map((t) => clamped(t, 0, this.to)));
      else if (start) this.seek(start.at);
      start = null;
    };
    canvas.ondblclick = () => this.whole();
    canvas.addEventListener("wheel", (e) => {
      const sideways = Math.abs(e.deltaX) > Math.abs(e.deltaY) && !e.ctrlKey && !e.shiftKey;
      const scrolls = $("lanes-box").scrollHeight > $("lanes-box").clientHeight;
      if (sideways) this.shift(e.deltaX / 600);
      else if (e.ctrlKey || e.shiftKey || !scrolls) this.zoom(Math.exp((e.deltaY || e.deltaX) / 500), time(e));
      else return;
      e.preventDefault();
    }, { passive: false });
  }

  hover(x, y) {
    const hit = this.hits.find(([x0, x1, y0, y1]) => x >= x0 && x <= x1 && y >= y0 && y <= y1);
    this.canvas.title = hit?.[4] ?? "";
  }

  key(e) {
    if (e.key === "+" || e.key === "=") this.zoom(0.8);
    else if (e.key === "-") this.zoom(1.25);
    else if (e.key === "0") this.whole();
    else if (e.shiftKey && e.key === "ArrowLeft") this.shift(-0.2);
    else if (e.shiftKey && e.key === "ArrowRight") this.shift(0.2);
    else return;
    e.preventDefault();
  }

  // -- drawing

  drawn() {
    const rows = this.rows(), high = `${TOP + Math.max(rows.length, 1) * ROW + 4}px`;
    if (this.canvas.style.height !== high) this.canvas.style.height = high;
    const [g, w, h] = prepared(this.canvas), [a, b] = this.view, now = this.app.now();
    if (!w) return;
    const left = this.left = Math.min(140, w * 0.25), x = (t) => left + ((t - a) / (b - a)) * (w - left);
    g.font = "11px system-ui, sans-serif";
    g.textBaseline = "middle";
    this.hits = [];
    if (this.range) {
      g.fillStyle = colour("range");
      g.fillRect(x(this.range[0]), 0, x(this.range[1]) - x(this.range[0]), h);
    }
    this.axis(g, x, w, h);
    rows.forEach((row, i) => this.row(g, row, TOP + i * ROW, x, w));
    this.label(now);
    this.sets.forEach(({ marks }, slot) => marks.forEach((mark) => this.marked(g, mark, slot, x, w)));
    g.fillStyle = colour("accent");
    if (now >= a && now <= b) g.fillRect(x(now) - 0.75, 0, 1.5, h);
    Object.assign($("slider"), { max: this.to, value: now, ariaValueText: seconds(now) });
    this.app.signals.later();
  }

  /** What stands below each other: lanes with something in them; of two records, each with its title first. */
  rows() {
    return this.sets.flatMap(({ lanes, to }, slot) => [
      ...(this.sets.length > 1 ? [{ title: this.app.hello.runs[slot].title, spans: [] }] : []),
      ...[...lanes.values()].filter(({ spans }) => spans.length).map((lane) => (
        { ...lane, now: this.app.live ? this.app.newest : to })),
    ]);
  }

  /** For readers of the screen: which lanes go on at the instant `now`, and the last mark; no figure that runs. */
  label(now) {
    const told = this.sets.flatMap(({ lanes, marks }) => [
      ...[...lanes.values()].flatMap(({ path, spans }) => {
        const on = spans.findLast(([from, to]) => from <= now && (to === null || to > now));
        return on ? [`${path} since ${seconds(on[0])}`] : [];
      }),
      ...marks.filter(({ at }) => at <= now).slice(-1).map(({ at, kind, text }) => `${seconds(at)} ${kind}: ${text}`),
    ]);
    const label = ["lanes of the timeline", ...told].join("; ");
    if (this.canvas.ariaLabel !== label) this.canvas.ariaLabel = label;
  }

  axis(g, x, w, h) {
    const [a, b] = this.view, step = STEPS.find((s) => ((w - this.left) * s) / (b - a) > 64) ?? STEPS.at(-1);
    g.strokeStyle = colour("grid");
    g.fillStyle = colour("soft");
    g.lineWidth = 1;
    for (let t = Math.ceil(a / step) * step; t <= b; t += step) {
      g.beginPath();
      g.moveTo(x(t), 0);
      g.lineTo(x(t), h);
      g.stroke();
      if (x(t) < w - 30) g.fillText(`${Number(t.toFixed(2))} s`, x(t) + 3, 6);
    }
  }

  row(g, { title, path = "", name, spans, now }, y, x, w) {
    const own = nameOf(path), label = title ?? (!name || name === own || name === path ? own : `${own}: ${name}`);
    const deep = title ? 0 : Math.min(path.split("/").length - 1, 5);
    g.fillStyle = colour(title ? "accent" : "ink");
    g.save();
    g.beginPath();
    g.rect(0, y, title ? w : this.left - 6, ROW);
    g.clip();
    g.fillText(label, 4 + deep * 8, y + ROW / 2);
    g.restore();
    let last = -1;
    for (const [from, to, outcome] of spans) {
      const x0 = Math.max(x(from), this.left), x1 = Math.min(x(to ?? now), w);
      if (x1 < this.left || x0 > w || (x1 - last < 0.5 && x1 - x0 < 0.5)) continue;  // thinned to what a screen shows
      last = x1;
      g.fillStyle = colour(BAD_END.test(outcome) ? "span-bad" : to === null ? "span-now" : "span");
      g.fillRect(x0, y + 2, Math.max(x1 - x0 - 1, 1), ROW - 4);
      g.fillStyle = colour("span-ink");
      if (outcome && x1 - x0 > g.measureText(outcome).width + 8) g.fillText(outcome, x0 + 4, y + ROW / 2);
      const lasted = `${seconds(from)} – ${to === null ? "now" : seconds(to)}`;
      this.hits.push([x0, x1, y, y + ROW, `${path}: ${lasted}${outcome ? `, ${outcome}` : ""}`]);
    }
  }

  marked(g, { at, kind, text }, slot, x, w) {
    const mid = x(at);
    if (mid < this.left || mid > w) return;
    g.fillStyle = colour(BAD_MARK.test(`${kind} ${text}`) ? "bad" : MARKS[kind] ?? "mark");
    g.beginPath();
    g.moveTo(mid - 4, TOP - 9);
    g.lineTo(mid + 4, TOP - 9);
    g.lineTo(mid, TOP - 2);
    g.fill();
    this.hits.unshift([mid - 5, mid + 5, 4, TOP, `${seconds(at)} ${kind}: ${text}${slot ? " (second)" : ""}`]);
  }
}
