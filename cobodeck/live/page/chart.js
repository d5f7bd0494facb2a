// A chart: the SVG of `render`, lit by element. Shapes are found by their ids: s:PATH, o:PATH:OUTCOMES, t:PATH:OUTCOMES.

import { View, redraw, seconds } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";

function shape(tag, attributes, text = "") {
  const made = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

const above = (path) => path.slice(0, Math.max(path.lastIndexOf("/"), 0));
/** Of paths, those that have none of the others inside. */
export const deepest = (paths) => paths.filter((p) => p && !paths.some((q) => q !== p && within(q, p)));
const within = (path, box) => box === "" || path === box || path.startsWith(`${box}/`);

export class Chart {
  /** In `root`, the chart of `slot`; `pick(path, outcome)` is called for what is clicked, `now()` gives the time; `send` asks for folding. */
  constructor(root, slot, pick, now, send) {
    Object.assign(this, { root, slot, pick, now, send, svg: null, message: null, folded: new Set(), state: {}, bold: new Map(), text: "", picked: null });
    root.tabIndex = 0;
    this.view = new View(root, () => redraw(this.place));
    this.place = () => this.placed();
    this.tick = () => this.timed();
    root.addEventListener("click", (e) => this.clicked(e));
    root.addEventListener("keydown", (e) => { if (e.key === "f" && this.picked) this.fold(this.foldable(this.picked)); });
    root.addEventListener("dblclick", (e) => { const g = e.target.closest("[data-path]"); if (g) this.zoomTo(g.dataset.path); });
  }

  /** Takes a `chart` message; a text that cannot be read leaves the picture as it is. */
  show(message) {
    const other = message.name !== this.message?.name;
    this.message = message;
    this.root.classList.toggle("stale", message.stale);
    if (message.svg && message.svg !== this.text) this.read(message.svg, other);
    this.light(this.state);
  }

  read(text, other) {
    const svg = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
    if (svg.nodeName !== "svg" || svg.querySelector("parsererror")) return;
    this.text = text;
    const [x, y, w, h] = svg.getAttribute("viewBox").split(/\s+/).map(Number);
    svg.removeAttribute("width");
    svg.removeAttribute("height");
    svg.setAttribute("role", "img");
    this.index(svg);
    this.over = svg.querySelector("g.graph").appendChild(shape("g", { class: "over" }));
    this.root.replaceChildren(document.adoptNode(svg));
    this.svg = svg;
    const same = this.size && !other && this.view.moved;
    this.size = [x, y, w, h];
    if (!same) this.view.fit(x, y, x + w, y + h, 1.6);
    this.placed();
  }

  /** What belongs to each path, before titles give way to words for a reader. */
  index(svg) {
    this.boxes = new Map();
    this.ways = new Map();
    this.parts = [];
    for (const g of svg.querySelectorAll("g[id]")) {
      const [, inner, kind, rest] = /^(a_)?([sot]):(.*)$/s.exec(g.id) ?? [];
      const title = g.querySelector(":scope > title");
      if (kind === "s") {
        g.dataset.path = rest;
        if (inner) this.boxes.set(rest, g);
        else this.parts.push([above(rest), rest, g]);
      } else if (kind) {
        const cut = rest.lastIndexOf(":"), path = rest.slice(0, cut), outcomes = rest.slice(cut + 1).split("|");
        Object.assign(g.dataset, { path, outcome: outcomes[0] });
        for (const o of outcomes) this.ways.set(`${path}:${o}`, [...(this.ways.get(`${path}:${o}`) ?? []), g]);
        if (!inner) this.parts.push([kind === "t" ? above(path) : path, path, g]);
      } else if (title && /node|edge/.test(g.getAttribute("class"))) {
        const path = title.textContent.split(/->|:/)[0];
        this.parts.push([path, path, g]);
      }
      if (this.slot) g.id = `${this.slot}:${g.id}`;
      title?.remove();
    }
    for (const a of svg.querySelectorAll("a")) {
      const about = a.getAttribute("xlink:title")?.trim();
      if (about && a.parentNode.dataset.path) a.parentNode.prepend(shape("title", {}, about));
    }
    this.inside = new Map();
    for (const g of svg.querySelectorAll("g.cluster")) this.inside.set(g.dataset.path, g);
    for (const [path, g] of this.boxes) g.classList.add("shape", `k-${this.message.nodes?.[path]?.kind ?? "box"}`);
    for (const [path, g] of this.inside) this.boxes.get(path)?.classList.add("frame"), g.classList.add("cluster");
  }

  /** The shape that stands for `path`: itself, or what hides it. */
  shown(path) {
    let at = path;
    for (let p = path; p; p = above(p)) if (this.folded.has(above(p)) || !this.boxes.has(p)) at = above(p);
    return at;
  }

  /** Lights what is active in `state`. */
  light(state) {
    this.state = state;
    if (!this.svg) return;
    for (const g of this.svg.querySelectorAll(".active, .leaf, .waiting, .locked")) g.classList.remove("active", "leaf", "waiting", "locked");
    const active = Object.keys(state.active ?? {}), leaves = deepest(active);
    for (const path of active) for (let p = this.shown(path); p; p = above(p)) this.boxes.get(p)?.classList.add("active");
    this.times = new Map();
    for (const path of leaves) this.boxes.get(this.shown(path))?.classList.add("leaf");
    this.doing = deepest(active.filter((p) => this.message.nodes?.[p]?.kind !== "watch"));
    for (const path of this.doing) {
      const at = this.shown(path);
      if (at) this.times.set(at, { since: state.active[at === path ? path : at] ?? state.active[path], below: at === path ? "" : path.slice(at.length + 1) });
    }
    for (const [path, outcome] of Object.entries(state.waiting ?? {})) for (const g of this.ways.get(`${path}:${outcome}`) ?? [this.boxes.get(this.shown(path))]) g?.classList.add("waiting");
    for (const path of state.locks ?? []) this.boxes.get(path)?.classList.add("locked");
    this.svg.setAttribute("aria-label", `chart ${this.message.name}; active: ${this.doing.join(", ") || "nothing"}`);
    this.overlay();
  }

  /** Bold for a second: a transition just taken; the outcome of a row is drawn at a box that it ends. */
  taken(path, outcome) {
    let at = path;
    while (at && !this.ways?.has(`${at}:${outcome}`)) at = above(at);
    const all = this.ways?.get(`${at}:${outcome}`) ?? [];
    for (const g of all) {
      g.classList.add("taken");
      clearTimeout(this.bold.get(g));
      this.bold.set(g, setTimeout(() => { g.classList.remove("taken"); this.bold.delete(g); }, 1000));
    }
  }

  bounds(path) { return this.boxes.get(path)?.querySelector("path, polygon")?.getBBox(); }

  /** Dots, badges, times and buttons to fold, over the shapes. */
  overlay() {
    const marks = [];
    const badge = (path, name, text, about, corner = 0) => {
      const b = this.boxes.has(path) && this.shown(path) === path && this.bounds(path);
      if (!b) return;
      const g = shape("g", { class: `badge ${name}`, transform: `translate(${b.x + (corner ? b.width : 0)} ${b.y})`, "data-path": path });
      g.append(shape("circle", { r: 6 }), shape("text", { y: 3.2, "text-anchor": "middle" }, text), shape("title", {}, about));
      marks.push(g);
    };
    for (const path of this.state.breaks ?? Object.entries(this.message.nodes ?? {}).filter(([, n]) => n.break).map(([p]) => p)) badge(path, "break", "", "breakpoint");
    for (const path of this.state.locks ?? []) badge(path, "lock", "L", "locked", 1);
    for (const [path, outcome] of Object.entries(this.state.waiting ?? {})) badge(path, "wait", "?", `${outcome} waits for consent`, 1);
    const worst = new Map();
    for (const f of this.message.findings ?? []) {
      if (f.path === null) continue;
      const had = worst.get(f.path);
      worst.set(f.path, { severity: had?.severity === "error" ? "error" : f.severity, text: [...(had?.text ?? []), `${f.code}: ${f.message}`] });
    }
    for (const [path, { severity, text }] of worst) badge(path, severity, String(text.length), text.join("\n"), 1);
    for (const path of this.boxes.keys()) {
      const folded = this.closed(path);
      const b = path && (folded || this.inside.has(path)) && this.shown(path) === path && this.bounds(path);
      if (!b) continue;
      const g = shape("g", { class: "folder", transform: `translate(${b.x + b.width - 13} ${b.y + 13})`, "data-fold": path });
      g.append(shape("rect", { x: -7, y: -7, width: 14, height: 14, rx: 3 }), shape("text", { y: 4, "text-anchor": "middle" }, folded ? "+" : "−"), shape("title", {}, folded ? "unfold" : "fold"));
      marks.push(g);
    }
    this.clocks = [];
    for (const [path, time] of this.times ?? []) {
      const b = this.bounds(path);
      if (!b) continue;
      const text = shape("text", { class: "since", x: b.x + b.width - 4, y: b.y - 3, "text-anchor": "end" });
      if (time.below && this.inside.has(path)) Object.entries({ x: b.x + b.width / 2, y: b.y + b.height / 2, "text-anchor": "middle" }).forEach(([k, v]) => text.setAttribute(k, v));
      this.clocks.push([text, time]);
      marks.push(text);
    }
    this.over.replaceChildren(...marks);
    this.timed();
  }

  timed() {
    for (const [text, { since, below }] of this.clocks ?? []) {
      const is = `${below ? `${below} · ` : ""}${seconds(Math.max(0, this.now() - since))}`;
      if (text.textContent !== is) text.textContent = is;
    }
  }

  /** Used charts are folded by the server, which draws anew; other boxes are emptied here. */
  drawnAnew(path) { return this.message.unfolded !== undefined && this.message.nodes?.[path]?.kind === "use"; }

  closed(path) { return this.folded.has(path) || (this.drawnAnew(path) && !(this.message.unfolded?.includes(path) ?? true)); }

  /** The innermost box around `path` that can be folded. */
  foldable(path) {
    let at = path;
    while (at && !this.inside.has(at) && !this.drawnAnew(at)) at = above(at);
    return at;
  }

  fold(path) {
    if (!path) return;
    const on = !this.closed(path);
    if (this.drawnAnew(path)) { this.send({ t: "unfold", path, on: !on, slot: this.slot }); return; }
    if (on) this.folded.add(path); else this.folded.delete(path);
    this.hide();
  }

  get allClosed() {
    const open = this.message?.unfolded;
    return open ? !open.length && Object.values(this.message.nodes).some((n) => n.kind === "use") : this.folded.size > 0;
  }

  foldAll(on = !this.allClosed) {
    if (this.message?.unfolded !== undefined) { this.send({ t: "unfold", path: null, on: !on, slot: this.slot }); return; }
    this.folded = new Set(on ? [...this.inside.keys()].filter((p) => p && !above(p)) : []);
    this.hide();
  }

  hide() {
    for (const [box, path, g] of this.parts) {
      let away = false;
      for (let p = box; p; p = above(p)) away ||= this.folded.has(p) && !(p === path && g.id.includes("o:"));
      g.classList.toggle("away", away);
    }
    this.light(this.state);
  }

  clicked(e) {
    const folder = e.target.closest("[data-fold]");
    if (folder) return this.fold(folder.dataset.fold);
    const g = e.target.closest("[data-path]");
    if (g) this.pick(g.dataset.path, g.dataset.outcome ?? null);
  }

  /** Marks `path` as the one whose details are shown. */
  mark(path) {
    this.svg?.querySelector(".picked")?.classList.remove("picked");
    const at = path === null ? null : this.shown(path);
    this.picked = path;
    this.boxes?.get(at)?.classList.add("picked");
  }

  /** Shows the box around `path` as large as is readable. */
  zoomTo(path, most = 1.6) {
    const b = this.bounds(this.shown(path));
    if (!b) return;
    const m = this.svg.querySelector("g.graph").getCTM(), k = m.a / this.view.k;
    const ox = (m.e - this.view.x) / this.view.k, oy = (m.f - this.view.y) / this.view.k;
    const home = this.view.home;
    this.view.fit(ox + (b.x - 30) * k, oy + (b.y - 30) * k, ox + (b.x + b.width + 30) * k, oy + (b.y + b.height + 30) * k, most);
    Object.assign(this.view, { home, moved: true });
  }

  /** Keeps the deepest box that holds all that is active in view, where letters can be read. */
  follow() {
    if (!this.times?.size || !this.svg) return;
    const [leaf] = [...this.times].sort(([, a], [, b]) => b.since - a.since)[0];
    let at = leaf;
    const { clientWidth: w, clientHeight: h } = this.root;
    for (let p = leaf; p; p = above(p)) {
      const b = this.bounds(p);
      if (b && b.width * 0.75 < w && b.height * 0.75 < h) at = p;
    }
    this.zoomTo(at, 1.15);
  }

  placed() {
    if (!this.svg) return;
    const { x, y, k } = this.view, w = this.root.clientWidth, h = this.root.clientHeight;
    if (w && h) this.svg.setAttribute("viewBox", `${-x / k} ${-y / k} ${w / k} ${h / k}`);
  }
}
