// The room and what moves in it on a canvas; shapes come in metres, colours from the style sheet.

import { $, View, colour, el, forgetColours, prepared, redraw } from "./dom.js";

const RAINBOW = Array.from({ length: 65 }, (_, i) => `hsl(${(i / 64) * 280} 85% 55%)`);  // red is the lowest
const WIDE = { path: 2.5, goal: 2.5, robot: 2, user: 2, arm: 4, held: 4, wall: 1.5 };

export class RoomMap {
  constructor(send) {
    Object.assign(this, { canvas: $("map"), send, room: [], moving: [[], []], off: new Set(), styles: new Map(), still: null });
    this.view = new View(this.canvas, () => redraw(this.draw));
    this.draw = () => this.drawn();
    $("map-fit").onclick = () => { $("map-follow").checked = false; this.whole(); };
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recoloured());
  }

  recoloured() { forgetColours(); this.still = null; redraw(this.draw); }

  layers(list) {
    this.off = new Set(list.filter((l) => !l.on).map((l) => l.name));
    this.list = list.map((l) => l.name);
    $("layers").replaceChildren(...list.map(({ name, on }) => {
      const box = el("input", { type: "checkbox", checked: on, id: `layer-${name}` });
      box.onchange = () => {
        if (box.checked) this.off.delete(name); else this.off.add(name);
        this.still = null;
        this.send({ t: "layers", on: this.list.filter((l) => !this.off.has(l)) });
        redraw(this.draw);
      };
      return el("li", {}, el("label", { htmlFor: box.id }, box, el("span", { className: "swatches", id: `swatch-${name}` }), name));
    }));
    this.styles.clear();
    this.legend([...this.room, ...this.moving.flat()]);
  }

  show(message) {
    this.room = message.shapes;
    this.still = null;
    const [x0, y0, x1, y1] = message.bounds, same = String(this.bounds) === String(message.bounds);
    this.bounds = [x0, y0, x1, y1];
    if (!same) this.whole();
    this.legend(message.shapes);
    redraw(this.draw);
  }

  frame(message) {
    this.moving[message.slot ?? 0] = message.shapes;
    this.legend(message.shapes);
    redraw(this.draw);
  }

  whole() {
    const [x0, y0, x1, y1] = this.bounds ?? [-5, -5, 5, 5];
    this.view.fit(x0 - 0.2, -y1 - 0.2, x1 + 0.2, 0.2 - y0);
  }

  /** A swatch in the list of layers for each style that has been seen. */
  legend(shapes) {
    for (const s of shapes) {
      const key = `${s.l}:${s.c}`;
      if (this.styles.has(key)) continue;
      this.styles.set(key, true);
      const swatch = el("i", { title: s.c === "chase" ? "chase: red the lowest, purple the highest" : s.c, className: s.k === "cells" && s.c === "chase" ? "rainbow" : "" });
      if (!swatch.className) swatch.style.background = `var(--c-${s.c}, var(--ink))`;
      $(`swatch-${s.l}`)?.append(swatch);
    }
  }

  drawn() {
    const [g, w, h] = prepared(this.canvas);
    if (!w) return;
    if ($("map-follow").checked) this.follow();
    const { x, y, k } = this.view, key = [x, y, k, w, h].join();
    if (this.still?.key !== key) {
      const still = new OffscreenCanvas(this.canvas.width, this.canvas.height), s = still.getContext("2d");
      s.scale(this.canvas.width / w, this.canvas.height / h);
      this.grid(s, w, h);
      for (const one of this.room) this.shape(s, one);
      this.still = { key, still };
    }
    g.drawImage(this.still.still, 0, 0, w, h);
    for (const one of this.moving[0]) this.shape(g, one);
    g.globalAlpha = 0.45;
    for (const one of this.moving[1]) this.shape(g, one, 0.45);
    g.globalAlpha = 1;
    this.scale(g, h);
  }

  follow() {
    const robot = this.moving[0].find((s) => s.c === "robot");
    if (!robot) return;
    const xs = robot.p.filter((_, i) => i % 2 === 0), ys = robot.p.filter((_, i) => i % 2), mean = (a) => a.reduce((s, v) => s + v, 0) / a.length;
    this.view.x = this.canvas.clientWidth / 2 - mean(xs) * this.view.k;
    this.view.y = this.canvas.clientHeight / 2 + mean(ys) * this.view.k;
  }

  grid(g, w, h) {
    const { x, y, k } = this.view, step = k > 12 ? 1 : 5;
    g.strokeStyle = colour("grid");
    g.lineWidth = 1;
    g.beginPath();
    for (let i = Math.ceil(-x / k / step); i <= (w - x) / k / step; i++) { g.moveTo(i * step * k + x, 0); g.lineTo(i * step * k + x, h); }
    for (let i = Math.ceil(-y / k / step); i <= (h - y) / k / step; i++) { g.moveTo(0, i * step * k + y); g.lineTo(w, i * step * k + y); }
    g.stroke();
  }

  scale(g, h) {
    const long = [0.1, 0.5, 1, 2, 5, 10].find((m) => m * this.view.k >= 40) ?? 20;
    g.fillStyle = g.strokeStyle = colour("ink");
    g.lineWidth = 2;
    g.beginPath(); g.moveTo(10, h - 10); g.lineTo(10 + long * this.view.k, h - 10); g.stroke();
    g.font = "12px system-ui, sans-serif";
    g.fillText(`${long} m`, 12, h - 15);
  }

  shape(g, s, alpha = 1) {
    if (this.off.has(s.l)) return;
    const { x, y, k } = this.view, p = s.p, X = (i) => p[i] * k + x, Y = (i) => y - p[i + 1] * k;
    g.globalAlpha = alpha * (s.a ?? 1);
    g.fillStyle = g.strokeStyle = colour(`c-${s.c}`);
    g.lineWidth = WIDE[s.c] ?? 1.2;
    g.lineJoin = g.lineCap = "round";
    if (s.k === "cells") this.cells(g, s, X, Y);
    else if (s.k === "dots") {
      const r = Math.max((s.r ?? 0) * k, 1.3);
      for (let i = 0; i < p.length; i += 2) g.fillRect(X(i) - r, Y(i) - r, 2 * r, 2 * r);
    } else if (s.k === "disc") for (let i = 0; i < p.length; i += 2) {
      g.beginPath(); g.arc(X(i), Y(i), Math.max(s.r * k, 1.5), 0, 7);
      if (s.fill) g.fill(); else g.stroke();
    } else if (s.k === "text") { g.font = "12px system-ui, sans-serif"; g.fillText(s.s, X(0), Y(0)); }
    else if (p.length >= 4) {
      g.beginPath();
      for (let i = 0; i < p.length; i += 2) g.lineTo(X(i), Y(i));
      if (s.k === "poly") g.closePath();
      if (s.fill) g.fill(); else g.stroke();
      if (s.k === "arrow") this.head(g, X(p.length - 4), Y(p.length - 4), X(p.length - 2), Y(p.length - 2));
    } else if (s.k === "arrow") {
      const long = Math.max((s.r ?? 0.3) * k, 10), bx = X(0) + long * Math.cos(s.yaw ?? 0), by = Y(0) - long * Math.sin(s.yaw ?? 0);
      g.beginPath(); g.moveTo(X(0), Y(0)); g.lineTo(bx, by); g.stroke();
      this.head(g, X(0), Y(0), bx, by);
    }
    if (s.s && s.k !== "text") { g.font = "11px system-ui, sans-serif"; g.globalAlpha = alpha; g.fillText(s.s, X(0) + 4, Y(0) - 4); }
    g.globalAlpha = alpha;
  }

  head(g, ax, ay, bx, by) {
    const turn = Math.atan2(by - ay, bx - ax), long = Math.min(9, Math.hypot(bx - ax, by - ay));
    g.beginPath(); g.moveTo(bx, by);
    for (const side of [2.7, -2.7]) g.lineTo(bx + long * Math.cos(turn + side), by + long * Math.sin(turn + side));
    g.closePath(); g.fill();
  }

  /** Squares about their centres, by weight: for Chase in the colours of the rainbow, purple for the highest. */
  cells(g, s, X, Y) {
    const side = s.cell * this.view.k, c = (side / 2) * Math.cos(s.yaw ?? 0), n = (side / 2) * Math.sin(s.yaw ?? 0);
    const groups = new Map();
    for (let i = 0; i < s.w.length; i++) {
      const level = Math.round(Math.min(Math.max(s.w[i], 0), 1) * 64);
      if (s.c !== "chase" && !level) continue;
      let group = groups.get(level);
      if (!group) groups.set(level, group = new Path2D());
      const a = X(2 * i), b = Y(2 * i);
      if (!s.yaw) { group.rect(a - side / 2, b - side / 2, side, side); continue; }
      group.moveTo(a + c - n, b - n - c); group.lineTo(a - c - n, b + n - c); group.lineTo(a - c + n, b + n + c); group.lineTo(a + c + n, b - n + c); group.closePath();
    }
    const alpha = g.globalAlpha;
    for (const [level, group] of groups) {
      if (s.c === "chase") g.fillStyle = RAINBOW[level];
      else g.globalAlpha = (alpha * level) / 64;
      g.fill(group);
    }
  }
}
