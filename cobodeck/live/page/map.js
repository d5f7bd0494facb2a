// The room and what moves in it on a canvas; shapes come in metres, colours from the style sheet.

import { $, colour, el, forgetColours, prepared, redraw } from "./dom.js";
import { View } from "./view.js";

const RAINBOW = Array.from({ length: 65 }, (_, i) => `hsl(${(i / 64) * 280} 85% 55%)`);  // red is the lowest
const WIDE = {
  path: 2.5, goal: 2.5, robot: 2, user: 2, arm: 4, held: 4, wall: 1.5, "trail-robot": 2.5, "trail-user": 2.5,
};
const LETTERS = "12px system-ui, sans-serif";
const CASED = new Set(["path", "goal", "chase", "escape", "haptic", "dropped"]);  // what may lie on cells
const CASE = 3;  // px, in the colour of the pane
const PALE = 0.45;  // the second of two runs

export class RoomMap {
  constructor(send) {
    Object.assign(this, { canvas: $("map"), send, room: [], moving: [[], []], bounds: [-5, -5, 5, 5] });
    Object.assign(this, { names: [], off: new Set(), styles: new Set(), still: null });
    this.view = new View(this.canvas, () => redraw(this.draw));
    this.draw = () => this.drawn();
    $("map-fit").onclick = () => { $("map-follow").checked = false; this.whole(); };
  }

  recoloured() {
    forgetColours();
    this.changed();
  }

  /** What stands still is drawn anew, too. */
  changed() {
    this.still = null;
    redraw(this.draw);
  }

  /** Boxes to check; what a person has chosen holds until the page is left. */
  layers(list) {
    const names = list.map((l) => l.name);
    if (names.length && String(this.names) === String(names)) this.tellLayers();
    else Object.assign(this, { names, off: new Set(list.filter((l) => !l.on).map((l) => l.name)) });
    $("layers").replaceChildren(...this.names.map((name) => this.layer(name)));
    this.styles.clear();
    this.legend([...this.room, ...this.moving.flat()]);
  }

  layer(name) {
    const box = el("input", { type: "checkbox", checked: !this.off.has(name), id: `layer-${name}` });
    box.onchange = () => {
      if (box.checked) this.off.delete(name); else this.off.add(name);
      this.tellLayers();
      this.changed();
    };
    return el("li", {}, el("label", {}, box, el("span", { className: "swatches", id: `swatch-${name}` }), name));
  }

  tellLayers() { this.send({ t: "layers", on: this.names.filter((l) => !this.off.has(l)) }); }

  show({ shapes, bounds: [x0, y0, x1, y1] }) {
    const same = String(this.bounds) === String([x0, y0, x1, y1]);
    Object.assign(this, { room: shapes, bounds: [x0, y0, x1, y1] });
    if (!same || !this.view.moved) this.whole();
    this.legend(shapes);
    this.changed();
  }

  frame({ shapes, slot = 0 }) {
    this.moving[slot] = shapes;
    this.legend(shapes);
    redraw(this.draw);
  }

  whole() {
    const [x0, y0, x1, y1] = this.bounds;
    this.view.wholeIs(x0 - 0.2, -y1 - 0.2, x1 + 0.2, 0.2 - y0);
    this.view.whole();
  }

  /** A swatch in the list of layers for each style that has been seen. */
  legend(shapes) {
    for (const { l, c, k } of shapes) {
      if (this.styles.has(`${l}:${c}`)) continue;
      this.styles.add(`${l}:${c}`);
      const rainbow = c === "chase" && k === "cells";
      const title = rainbow ? "chase: red the lowest, purple the highest" : c;
      const swatch = el("i", { title, className: rainbow ? "rainbow" : "" });
      if (!rainbow) swatch.style.background = `var(--c-${c}, var(--ink))`;
      $(`swatch-${l}`)?.append(swatch);
    }
  }

  drawn() {
    const [g, w, h] = prepared(this.canvas);
    if (!w) return;
    if ($("map-follow").checked) this.follow();
    const { x, y, k } = this.view, key = [x, y, k, this.canvas.width, this.canvas.height].join();
    if (this.still?.key !== key) {
      const still = new OffscreenCanvas(this.canvas.width, this.canvas.height), s = still.getContext("2d");
      s.scale(this.canvas.width / w, this.canvas.height / h);
      this.grid(s, w, h);
      for (const one of this.room) this.shape(s, one);
      this.still = { key, still };
    }
    g.drawImage(this.still.still, 0, 0, w, h);
    for (const one of this.moving[0]) this.shape(g, one);
    for (const one of this.moving[1]) this.shape(g, one, PALE);
    g.globalAlpha = 1;
    this.scale(g, h);
    const told = ["robot", "user"].map((c) => [c, this.middle(c)]).filter(([, at]) => at).map(([c, at]) =>
      `${c} at ${at.map((v) => v.toFixed(1)).join(", ")} m`);
    this.canvas.ariaLabel = ["map", ...told].join("; ");
  }

  /** The middle of the first shape of a style, m. */
  middle(style) {
    const p = this.moving[0].find((s) => s.c === style)?.p;
    return p && [0, 1].map((axis) => p.reduce((sum, v, i) => (i % 2 === axis ? sum + v : sum), 0) / (p.length / 2));
  }

  follow() {
    const at = this.middle("robot");
    if (!at) return;
    this.view.x = this.canvas.clientWidth / 2 - at[0] * this.view.k;
    this.view.y = this.canvas.clientHeight / 2 + at[1] * this.view.k;
  }

  grid(g, w, h) {
    const { x, y, k } = this.view, step = k > 12 ? k : 5 * k, first = (at) => ((at % step) + step) % step;
    g.strokeStyle = colour("grid");
    g.lineWidth = 1;
    g.beginPath();
    for (let at = first(x); at <= w; at += step) { g.moveTo(at, 0); g.lineTo(at, h); }
    for (let at = first(y); at <= h; at += step) { g.moveTo(0, at); g.lineTo(w, at); }
    g.stroke();
  }

  scale(g, h) {
    const metres = [0.1, 0.5, 1, 2, 5, 10].find((m) => m * this.view.k >= 40) ?? 20;
    g.fillStyle = colour("ink");
    g.fillRect(10, h - 11, metres * this.view.k, 2);
    g.font = LETTERS;
    g.fillText(`${metres} m`, 12, h - 15);
  }

  shape(g, s, alpha = 1) {
    if (this.off.has(s.l)) return;
    const { x, y, k } = this.view, p = s.p, X = (i) => p[i] * k + x, Y = (i) => y - p[i + 1] * k;
    g.globalAlpha = alpha * (s.a ?? 1);
    g.fillStyle = g.strokeStyle = colour(`c-${s.c}`);
    g.lineWidth = WIDE[s.c] ?? 1.2;
    g.lineJoin = g.lineCap = "round";
    if (CASED.has(s.c) && s.k !== "cells" && !s.fill) this.cased(g, () => this[s.k]?.(g, s, X, Y));
    else this[s.k]?.(g, s, X, Y);
    if (!s.s) return;
    g.globalAlpha = alpha;
    g.font = LETTERS;
    const off = s.k === "text" ? 0 : 4;
    g.lineWidth = 0;
    this.cased(g, (only) => g[only ? "strokeText" : "fillText"](s.s, X(0) + off, Y(0) - off));
  }

  /** Draws a line or letters above a wider one in the colour of the pane, so that they stand out on all. */
  cased(g, draw) {
    const own = g.fillStyle, wide = g.lineWidth;
    g.fillStyle = g.strokeStyle = colour("pane");
    g.lineWidth = wide + CASE;
    draw(true);
    g.fillStyle = g.strokeStyle = own;
    g.lineWidth = wide;
    draw(false);
  }

  // -- one for each kind of shape

  dots(g, { p, r = 0 }, X, Y) {
    const half = Math.max(r * this.view.k, 1.3);
    for (let i = 0; i < p.length; i += 2) g.fillRect(X(i) - half, Y(i) - half, 2 * half, 2 * half);
  }

  disc(g, { p, r, fill }, X, Y) {
    for (let i = 0; i < p.length; i += 2) {
      g.beginPath();
      g.arc(X(i), Y(i), Math.max(r * this.view.k, 1.5), 0, 7);
      if (fill) g.fill(); else g.stroke();
    }
  }

  line(g, s, X, Y) { this.along(g, s, X, Y, false); }

  poly(g, s, X, Y) { this.along(g, s, X, Y, true); }

  along(g, { p, fill }, X, Y, closed) {
    g.beginPath();
    for (let i = 0; i < p.length; i += 2) g.lineTo(X(i), Y(i));
    if (closed) g.closePath();
    if (fill) g.fill(); else g.stroke();
  }

  /** From point to point, or from one point at an angle. */
  arrow(g, s, X, Y) {
    const last = s.p.length - 2;
    if (last) {
      this.along(g, s, X, Y, false);
      this.head(g, X(last - 2), Y(last - 2), X(last), Y(last));
      return;
    }
    const long = Math.max((s.r ?? 0.3) * this.view.k, 10), yaw = s.yaw ?? 0;
    const bx = X(0) + long * Math.cos(yaw), by = Y(0) - long * Math.sin(yaw);
    g.beginPath();
    g.moveTo(X(0), Y(0));
    g.lineTo(bx, by);
    g.stroke();
    this.head(g, X(0), Y(0), bx, by);
  }

  head(g, ax, ay, bx, by) {
    const turn = Math.atan2(by - ay, bx - ax), long = Math.min(9, 0.6 * Math.hypot(bx - ax, by - ay));
    g.beginPath();
    g.moveTo(bx, by);
    for (const side of [2.7, -2.7]) g.lineTo(bx + long * Math.cos(turn + side), by + long * Math.sin(turn + side));
    g.closePath();
    g.fill();
    g.stroke();
  }

  /** Squares about their centres, by weight: for Chase in the colours of the rainbow, purple for the highest. */
  cells(g, s, X, Y) {
    const half = (s.cell * this.view.k) / 2, yaw = s.yaw ?? 0;
    const c = half * (Math.cos(yaw) - Math.sin(yaw)), n = half * (Math.cos(yaw) + Math.sin(yaw));
    const groups = new Map(), alpha = g.globalAlpha;
    for (let i = 0; i < s.w.length; i++) {
      const level = Math.round(Math.min(Math.max(s.w[i], 0), 1) * 64);
      if (s.c !== "chase" && !level) continue;
      if (!groups.has(level)) groups.set(level, new Path2D());
      const group = groups.get(level), x = X(2 * i), y = Y(2 * i);
      group.moveTo(x + c, y - n);
      group.lineTo(x - n, y - c);
      group.lineTo(x - c, y + n);
      group.lineTo(x + n, y + c);
      group.closePath();
    }
    for (const [level, group] of groups) {
      if (s.c === "chase") g.fillStyle = RAINBOW[level];
      else g.globalAlpha = (alpha * level) / 64;
      g.fill(group);
    }
  }
}
