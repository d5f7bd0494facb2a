// Lanes over time with marks; the slider, playing, and a range for figures. A second record has lanes below the first.

import { $, colour, el, prepared, redraw, seconds } from "./dom.js";

const ROW = 18, TOP = 20, SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];
const BAD = /error|fail|lost|fault|timeout|stuck|blocked/;

export class Timeline {
  constructor(app) {
    Object.assign(this, { app, canvas: $("lanes"), sets: [], window: null, range: null, hits: [], speed: 1, playing: false, sought: null });
    this.draw = () => this.drawn();
    $("speed").append(...SPEEDS.map((s) => el("option", { value: s, textContent: `${s}×` })));
    $("speed").value = 1;
    $("speed").onchange = () => { this.speed = Number($("speed").value); if (app.hello.mode === "live") app.command("speed", { speed: this.speed }); else if (this.playing) this.play(true); };
    $("play").onclick = () => this.play(!this.playing);
    $("previous").onclick = () => this.step(-1);
    $("next").onclick = () => this.step(1);
    $("slider").oninput = () => this.seek(Number($("slider").value));
    $("range-clear").onclick = () => this.take(null);
    this.pointer();
    new ResizeObserver(() => redraw(this.draw)).observe($("lanes-box"));
  }

  get from() { return Math.min(...this.sets.filter(Boolean).map((s) => s.from), Infinity) || 0; }
  get to() { return Math.max(...this.sets.filter(Boolean).map((s) => s.to), this.app.live ? this.app.now() : 0, 0); }
  get view() { return this.window ?? [Number.isFinite(this.from) ? this.from : 0, Math.max(this.to, 0.1)]; }

  /** Takes a `lanes` message, or what `lanes+` adds; a span with a known start is the same one, grown. */
  show(message, more) {
    const slot = message.slot ?? 0;
    if (!more || !this.sets[slot]) this.sets[slot] = { title: message.title, lanes: new Map(), marks: [], from: message.from, to: message.to };
    const set = this.sets[slot];
    for (const lane of message.lanes) {
      const had = set.lanes.get(lane.path);
      if (!had) { set.lanes.set(lane.path, { ...lane, spans: [...lane.spans] }); continue; }
      for (const span of lane.spans) {
        const last = had.spans.at(-1);
        if (last && last[0] === span[0] && last[1] === null) had.spans[had.spans.length - 1] = span; else had.spans.push(span);
      }
    }
    set.marks.push(...message.marks);
    Object.assign(set, { from: Math.min(set.from, message.from), to: Math.max(set.to, message.to) });
    redraw(this.draw);
  }

  /** Before a new run or record. */
  clear() { Object.assign(this, { sets: [], window: null, range: null }); redraw(this.draw); }

  playingAt(speed) {
    this.playing = speed > 0;
    if (SPEEDS.includes(speed)) $("speed").value = this.speed = speed;
    $("play").textContent = this.playing ? "pause" : "play";
  }

  play(on) { this.playingAt(on ? this.speed : 0); this.app.send({ t: "play", speed: on ? this.speed : 0 }); }

  /** Asks for the moment `at`; of what is asked within 60 ms, the last. */
  seek(at) {
    if (!this.app.seekable) return;
    this.sought = Math.min(Math.max(at, this.from), this.to);
    this.app.at = this.sought;
    redraw(this.app.moved);
    this.asking ||= setTimeout(() => { this.asking = 0; this.app.send({ t: "seek", at: this.sought }); }, 60);
  }

  step(way) {
    const now = this.app.now(), all = new Set();
    for (const lane of this.sets[0]?.lanes.values() ?? []) for (const [a, b] of lane.spans) { all.add(a); if (b !== null) all.add(b); }
    const times = [...all].sort((a, b) => a - b);
    const at = way > 0 ? times.find((t) => t > now + 1e-6) : times.findLast((t) => t < now - 1e-6);
    if (at !== undefined) this.seek(at);
  }

  /** Asks for the figures of a range, `null`: of all; of a live run, which has none of a part, shows the range alone. */
  take(range) {
    if (!this.app.seekable) { Object.assign(this, { range: null, window: range }); redraw(this.draw); return; }
    this.range = range;
    $("range-clear").hidden = !range;
    $("range-text").textContent = range ? `${seconds(range[0])} – ${seconds(range[1])}` : "";
    const [from, to] = range ?? [this.from, this.to];
    this.app.send({ t: "range", from, to });
    redraw(this.draw);
  }

  edge(which) {
    const now = this.app.now(), range = [...(this.range ?? [this.from, this.to])];
    range[which] = now;
    if (range[0] > range[1]) range[1 - which] = which ? this.from : this.to;
    this.take(range);
  }

  pointer() {
    const canvas = this.canvas;
    let start = null;
    const time = (e) => { const [a, b] = this.view, box = canvas.getBoundingClientRect(); return a + ((e.clientX - box.x - this.left) / (box.width - this.left)) * (b - a); };
    canvas.onpointerdown = (e) => { start = { x: e.clientX, at: time(e) }; canvas.setPointerCapture(e.pointerId); };
    canvas.onpointermove = (e) => {
      if (start && Math.abs(e.clientX - start.x) > 4) { this.range = [start.at, time(e)].sort((a, b) => a - b); redraw(this.draw); return; }
      const box = canvas.getBoundingClientRect(), x = e.clientX - box.x, y = e.clientY - box.y;
      canvas.title = this.hits.find((h) => x >= h[0] && x <= h[1] && y >= h[2] && y <= h[3])?.[4] ?? "";
    };
    canvas.onpointerup = (e) => {
      if (start && Math.abs(e.clientX - start.x) > 4) this.take(this.range.map((t) => Math.min(Math.max(t, this.from), this.to)));
      else if (start) this.seek(start.at);
      start = null;
    };
    canvas.ondblclick = () => { this.window = null; redraw(this.draw); };
    canvas.addEventListener("wheel", (e) => {
      if (e.deltaX && !e.ctrlKey && Math.abs(e.deltaX) > Math.abs(e.deltaY)) { e.preventDefault(); this.shift(e.deltaX / 600); }
      else if (e.ctrlKey || e.shiftKey || $("lanes-box").scrollHeight <= $("lanes-box").clientHeight) { e.preventDefault(); this.zoom(Math.exp((e.deltaY || e.deltaX) / 500), time(e)); }
    }, { passive: false });
    canvas.onkeydown = (e) => {
      if (e.key === "+" || e.key === "=") this.zoom(0.8); else if (e.key === "-") this.zoom(1.25);
      else if (e.key === "0") { this.window = null; redraw(this.draw); }
      else if (e.shiftKey && e.key === "ArrowLeft") this.shift(-0.2); else if (e.shiftKey && e.key === "ArrowRight") this.shift(0.2);
      else return;
      e.preventDefault();
    };
  }

  zoom(factor, at = this.app.now()) {
    const [a, b] = this.view;
    const next = [at - (at - a) * factor, at + (b - at) * factor];
    this.window = next[0] <= this.from && next[1] >= this.to ? null : [Math.max(next[0], this.from), Math.min(next[1], this.to)];
    if (this.window && this.window[1] - this.window[0] < 0.05) this.window = [a, b];
    redraw(this.draw);
  }

  shift(share) {
    const [a, b] = this.view, d = Math.min(Math.max((b - a) * share, this.from - a), this.to - b);
    this.window = [a + d, b + d];
    redraw(this.draw);
  }

  drawn() {
    const lanes = this.sets.flatMap((set, slot) => [...(this.sets.length > 1 ? [{ title: set.title ?? `record ${slot + 1}` }] : []), ...[...set.lanes.values()].map((lane) => ({ ...lane, slot }))]);
    const high = `${TOP + Math.max(lanes.length, 1) * ROW + 4}px`;
    if (this.canvas.style.height !== high) this.canvas.style.height = high;
    const [g, w, h] = prepared(this.canvas), [a, b] = this.view, now = this.app.now();
    if (!w) return;
    const left = this.left = Math.min(140, w * 0.25), x = (t) => left + ((t - a) / (b - a)) * (w - left);
    g.font = "11px system-ui, sans-serif";
    g.textBaseline = "middle";
    this.hits = [];
    this.axis(g, x, a, b, w, h);
    if (this.range) { g.fillStyle = colour("range"); g.fillRect(x(this.range[0]), 0, x(this.range[1]) - x(this.range[0]), h); }
    lanes.forEach((lane, i) => this.lane(g, lane, TOP + i * ROW, x, left, w, this.app.live ? now : this.sets[lane.slot]?.to));
    for (const [slot, set] of this.sets.entries()) for (const m of set.marks) {
      const at = x(m.at);
      if (at < left || at > w) continue;
      g.fillStyle = colour(/stop|fault|miss|late|error/.test(m.kind) ? "bad" : { request: "c-deep", escape: "c-escape" }[m.kind] ?? "mark");
      g.beginPath(); g.moveTo(at - 4, TOP - 9); g.lineTo(at + 4, TOP - 9); g.lineTo(at, TOP - 2); g.fill();
      this.hits.unshift([at - 5, at + 5, 4, TOP, `${seconds(m.at)} ${m.kind} ${m.text ?? ""}${slot ? " (second)" : ""}`]);
    }
    g.fillStyle = colour("accent");
    if (now >= a && now <= b) g.fillRect(x(now) - 0.75, 0, 1.5, h);
    const slider = $("slider");
    Object.assign(slider, { min: Number.isFinite(this.from) ? this.from : 0, max: this.to, value: now });
    slider.setAttribute("aria-valuetext", seconds(now));
    this.app.signals.later();
  }

  axis(g, x, a, b, w, h) {
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120, 300, 600, 1800, 3600].find((s) => ((w - this.left) * s) / (b - a) > 64) ?? 7200;
    g.strokeStyle = colour("grid");
    g.fillStyle = colour("soft");
    g.lineWidth = 1;
    for (let t = Math.ceil(a / step) * step; t <= b; t += step) {
      g.beginPath(); g.moveTo(x(t), 0); g.lineTo(x(t), h); g.stroke();
      if (x(t) < w - 30) g.fillText(`${Number(t.toFixed(2))} s`, x(t) + 3, 6);
    }
  }

  lane(g, lane, y, x, left, w, now) {
    g.fillStyle = colour(lane.title ? "accent" : "ink");
    const own = lane.path?.split("/").at(-1), name = lane.title ?? (!lane.name || lane.name === own || lane.name === lane.path ? own : `${own}: ${lane.name}`), deep = lane.title ? 0 : lane.path.split("/").length - 1;
    g.save(); g.beginPath(); g.rect(0, y, lane.title ? w : left - 6, ROW); g.clip();
    g.fillText(name, 4 + Math.min(deep, 5) * 8, y + ROW / 2); g.restore();
    let last = -1;
    for (const [from, to, outcome] of lane.spans ?? []) {
      const x0 = Math.max(x(from), left), x1 = Math.min(x(to ?? now), w);
      if (x1 < left || x0 > w || (x1 - last < 0.5 && x1 - x0 < 0.5)) continue;  // thinned to what a screen shows
      last = x1;
      g.fillStyle = colour(outcome && BAD.test(outcome) ? "span-bad" : to === null ? "span-now" : "span");
      g.fillRect(x0, y + 2, Math.max(x1 - x0 - 1, 1), ROW - 4);
      if (outcome && x1 - x0 > 9 * outcome.length) { g.fillStyle = colour("span-ink"); g.fillText(outcome, x0 + 4, y + ROW / 2); }
      this.hits.push([x0, x1, y, y + ROW, `${lane.path}: ${seconds(from)} – ${to === null ? "now" : seconds(to)}${outcome ? `, ${outcome}` : ""}`]);
    }
  }
}
