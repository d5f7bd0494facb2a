// A chart: its picture, lit by element. The keyboard walks it as a tree: one stop of Tab, arrows from node to node.

import { redraw } from "./dom.js";
import { marksOf, tell } from "./marks.js";
import { Picture, above, deepest, nameOf, within } from "./picture.js";
import { View } from "./view.js";

const LIT = ["active", "leaf", "waiting", "locked"];
const BOLD_MS = 1000;
const LARGEST = 1.6, FOLLOWED = 1.15;

export class Chart {
  /** In `root`; `pick(path, outcome)` is called for what is chosen, `now()` gives the time; `send` asks for folding. */
  constructor(root, slot, pick, now, send) {
    Object.assign(this, { root, slot, pick, now, send, picture: null, message: null, state: {} });
    Object.assign(this, { picked: null, stop: "", folded: new Set() });
    Object.assign(this, { bold: new Map(), times: new Map(), around: [], clocks: [], doing: [], recorded: false });
    root.tabIndex = -1;
    this.draw = () => this.placed();
    this.view = new View(root, () => redraw(this.draw));
    root.addEventListener("click", (e) => this.clicked(e));
    root.addEventListener("dblclick", (e) => {
      const path = e.target.closest("[data-path]")?.dataset.path;
      if (path !== undefined) this.zoomTo(path);
    });
    root.addEventListener("keydown", (e) => this.key(e));
  }

  /** Takes a `chart` message; a text that cannot be read leaves the picture as it is. */
  show(message) {
    const same = message.name === this.message?.name;
    this.message = message;
    this.root.classList.toggle("stale", message.stale);
    if (message.svg && message.svg !== this.picture?.text) this.take(Picture.read(message.svg, this.slot), same);
    this.light(this.state);
  }

  take(picture, same) {
    if (!picture) return;
    const held = this.root.contains(document.activeElement), stays = this.picture && same && this.view.moved;
    this.picture = picture;
    this.root.replaceChildren(picture.svg);
    for (const [path, g] of picture.boxes) {
      g.classList.add(`k-${this.message.nodes?.[path]?.kind ?? "box"}`);
      g.setAttribute("role", "treeitem");
      g.setAttribute("aria-level", path ? path.split("/").length + 1 : 1);
    }
    picture.svg.setAttribute("role", "tree");
    const [x, y, w, h] = picture.size;
    this.view.wholeIs(x, y, x + w, y + h, LARGEST);
    if (!stays) this.view.whole();
    picture.hide(this.folded);
    this.mark(this.picked);
    this.stopAt(this.stop, held);
    this.placed();
  }

  /** Breakpoints: a live run tells all, a record those that an operator has set, charts alone have their own. */
  get breaks() {
    const { breaks } = this.state;
    if (breaks && !this.recorded) return breaks;
    const written = Object.entries(this.message.nodes ?? {}).filter(([, n]) => n.break).map(([p]) => p);
    return [...new Set([...written, ...breaks ?? []])];
  }

  /** The shape that stands for `path`: itself, or what hides it. */
  shown(path) {
    let at = path;
    for (let p = path; p; p = above(p)) if (this.folded.has(above(p)) || !this.picture.boxes.has(p)) at = above(p);
    return at;
  }

  /** Lights what is active in `state`. */
  light(state) {
    this.state = state;
    if (!this.picture) return;
    const { svg, boxes, ways } = this.picture, active = Object.keys(state.active ?? {});
    const lit = Object.fromEntries(LIT.map((name) => [name, new Set()]));
    for (const path of active) for (let p = this.shown(path); p; p = above(p)) lit.active.add(boxes.get(p));
    for (const path of deepest(active)) lit.leaf.add(boxes.get(this.shown(path)));
    for (const path of state.locks ?? []) lit.locked.add(boxes.get(path));
    for (const [path, outcome] of Object.entries(state.waiting ?? {})) {
      for (const g of ways.get(`${path}:${outcome}`) ?? [boxes.get(this.shown(path))]) lit.waiting.add(g);
    }
    for (const name of LIT) {  // only what has changed is drawn anew
      for (const g of svg.querySelectorAll(`.${name}`)) if (!lit[name].delete(g)) g.classList.remove(name);
      for (const g of lit[name]) g?.classList.add(name);
    }
    this.doing = deepest(active.filter((p) => this.message.nodes?.[p]?.kind !== "watch"));
    this.times = new Map(this.doing.map((path) => [this.shown(path), path]).filter(([at]) => at).map(([at, path]) => [
      at, { since: state.active[at] ?? state.active[path], below: at === path ? "" : path.slice(at.length + 1) },
    ]));
    this.around = active.filter((p) => p && !this.times.has(p) && this.picture.frames.has(p) && this.isShown(p));
    svg.setAttribute("aria-label", `chart ${this.message.name}; active: ${this.doing.join(", ") || "nothing"}`);
    for (const [path, g] of boxes) {
      const label = this.label(path);
      if (g.getAttribute("aria-label") !== label) g.setAttribute("aria-label", label);
    }
    this.overlay();
  }

  /** What a reader of the screen is told of a node: its name, its kind, and how it is. */
  label(path) {
    const { kind = "", target } = this.message.nodes?.[path] ?? {}, { active, waiting, locks } = this.state;
    return [
      nameOf(path) || this.message.name,
      target ? `${kind} ${target}` : kind,
      active?.[path] !== undefined && "active",
      waiting?.[path] && `${waiting[path]} waits for consent`,
      locks?.includes(path) && "locked",
      this.breaks.includes(path) && "breakpoint",
      this.closed(path) && "folded",
    ].filter(Boolean).join(", ");
  }

  /** Bold for a second: a transition just taken; the outcome of a row is drawn at a box that it ends. */
  taken(path, outcome) {
    const ways = this.picture?.ways ?? new Map();
    let at = path;
    while (at && !ways.has(`${at}:${outcome}`)) at = above(at);
    for (const g of ways.get(`${at}:${outcome}`) ?? []) {
      g.classList.add("taken");
      clearTimeout(this.bold.get(g));
      this.bold.set(g, setTimeout(() => { g.classList.remove("taken"); this.bold.delete(g); }, BOLD_MS));
    }
  }

  /** Marks stay while what they tell does: each new one has the whole picture laid out. */
  overlay() {
    const { active = {}, locks, waiting } = this.state, around = this.around.map((path) => [path, active[path]]);
    const key = JSON.stringify([this.breaks, locks, waiting, [...this.folded], [...this.times], around]);
    const { over, marked } = this.picture;
    if (marked?.message !== this.message || marked.key !== key) {
      this.picture.marked = { message: this.message, key };
      const { marks, clocks } = marksOf(this);
      over.replaceChildren(...marks);
      this.clocks = clocks;
    }
    this.timed();
  }

  timed() { tell(this.clocks, this.now()); }

  // -- folding

  /** Used charts are folded by the server, which draws anew; other boxes are emptied here. */
  drawnAnew(path) { return this.message.unfolded !== undefined && this.message.nodes?.[path]?.kind === "use"; }

  /** Of used charts the server tells those that are open; `null`: all. */
  closed(path) {
    return this.folded.has(path) || (this.drawnAnew(path) && this.message.unfolded?.includes(path) === false);
  }

  /** The innermost box around `path` that can be folded; empty if there is none. */
  foldable(path) {
    let at = path;
    while (at && !this.picture.frames.has(at) && !this.drawnAnew(at)) at = above(at);
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
    if (!open) return this.folded.size > 0;
    return !open.length && Object.values(this.message.nodes).some((n) => n.kind === "use");
  }

  foldAll() {
    if (!this.picture) return;
    const on = !this.allClosed;
    if (this.message?.unfolded !== undefined) {
      this.send({ t: "unfold", path: null, on: !on, slot: this.slot });
      return;
    }
    this.folded = new Set(on ? [...this.picture.frames.keys()].filter((p) => p && !above(p)) : []);
    this.hide();
  }

  hide() {
    this.picture.hide(this.folded);
    this.light(this.state);
    this.mark(this.picked);
    this.stopAt(this.stop, this.root.contains(document.activeElement));
  }

  // -- choosing and walking

  clicked(e) {
    const folder = e.target.closest("[data-fold]");
    if (folder) { this.fold(folder.dataset.fold); return; }
    const g = e.target.closest("[data-path]");
    if (!g) return;
    this.stopAt(g.dataset.path, true);
    this.pick(g.dataset.path, g.dataset.outcome ?? null);
  }

  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey || e.shiftKey || !this.picture) return;
    const seen = this.message.nodes ? Object.keys(this.message.nodes).filter((p) => this.isShown(p)) : [];
    const i = seen.indexOf(this.stop), next = seen[i + 1];
    const inside = next !== undefined && within(next, this.stop) ? next : undefined;
    const to = {
      ArrowUp: seen[i - 1], ArrowDown: next, Home: seen[0], End: seen.at(-1),
      ArrowLeft: above(this.stop), ArrowRight: inside,
    };
    if (e.key in to) this.walk(to[e.key]);
    else if (e.key === "Enter") this.pick(this.stop, null);
    else if (e.key === "f") this.fold(this.foldable(this.stop));
    else return;
    e.preventDefault();
  }

  isShown(path) { return this.picture.boxes.has(path) && this.shown(path) === path; }

  /** Goes to a node by keyboard; what is not to be seen is brought into the middle. */
  walk(path) {
    if (path === undefined || !this.picture) return;
    this.stopAt(path, true);
    this.view.taken();
    this.placed();
    const [own, all] = [this.picture.boxes.get(this.stop), this.root].map((e) => e.getBoundingClientRect());
    if (own.x >= all.x && own.y >= all.y && own.right <= all.right && own.bottom <= all.bottom) return;
    if (own.width > all.width || own.height > all.height) this.zoomTo(this.stop);
    else this.view.pan(all.x + (all.width - own.width) / 2 - own.x, all.y + (all.height - own.height) / 2 - own.y);
  }

  /** Makes a node, or what hides it, the one that Tab stops at. */
  stopAt(path, focus = false) {
    const { boxes, svg } = this.picture;
    this.stop = boxes.has(path) ? this.shown(path) : "";
    for (const g of svg.querySelectorAll("[tabindex]")) g.setAttribute("tabindex", -1);
    boxes.get(this.stop)?.setAttribute("tabindex", 0);
    if (focus) boxes.get(this.stop)?.focus({ preventScroll: true });
  }

  /** Marks `path` as the one whose details are shown. */
  mark(path) {
    this.picked = path;
    this.picture?.svg.querySelector(".picked")?.classList.remove("picked");
    if (path !== null) this.picture?.boxes.get(this.shown(path))?.classList.add("picked");
  }

  // -- what is in view

  /** Shows the box around `path` as large as is readable. */
  zoomTo(path, most = LARGEST) {
    const b = this.picture?.bounds(this.shown(path));
    if (!b) return;
    this.placed();
    const m = this.picture.svg.querySelector("g.graph").getCTM(), { x, y, k } = this.view;
    const scale = m.a / k, wx = (v) => (m.e - x) / k + v * scale, wy = (v) => (m.f - y) / k + v * scale;
    this.view.show(wx(b.x - 30), wy(b.y - 30), wx(b.x + b.width + 30), wy(b.y + b.height + 30), most);
  }

  /** Keeps the largest box around what was entered last in view that can be read there. */
  follow() {
    if (!this.picture || !this.times.size) return;
    const [[leaf]] = [...this.times].sort(([, a], [, b]) => b.since - a.since);
    const { clientWidth: w, clientHeight: h } = this.root;
    let at = leaf;
    for (let p = leaf; p; p = above(p)) {
      const b = this.picture.bounds(p);
      if (b && b.width * 0.75 < w && b.height * 0.75 < h) at = p;
    }
    this.zoomTo(at, FOLLOWED);
  }

  /** Draws what the view shows; who measures what is drawn has it drawn first. */
  placed() {
    if (!this.picture) return;
    const { x, y, k } = this.view, { clientWidth: w, clientHeight: h } = this.root;
    const box = `${-x / k} ${-y / k} ${w / k} ${h / k}`;
    if (w && h && this.picture.svg.getAttribute("viewBox") !== box) this.picture.svg.setAttribute("viewBox", box);
  }
}
