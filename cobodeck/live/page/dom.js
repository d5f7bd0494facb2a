// What all panes share: elements, texts of times, one animation frame for all, a view to pan and zoom.

export const $ = (id) => document.getElementById(id);

/** A new element; names with a dash, and `role`, are attributes, the others properties. */
export function el(tag, props = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) {
    if (key.includes("-") || key === "role" || key === "list") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children.filter((c) => c !== null && c !== undefined));
  return made;
}

export const seconds = (t) => `${t.toFixed(1)} s`;

const due = new Set();
let asked = 0;

/** `pane` is called once in the next frame, however often this is. A hidden tab waits, then draws the newest. */
export function redraw(pane) {
  due.add(pane);
  asked ||= requestAnimationFrame(() => {
    asked = 0;
    const panes = [...due];
    due.clear();
    for (const one of panes) one();
  });
}

/** A button that does `act` when pressed again within 4 s. */
export function sure(text, act) {
  let timer = 0;
  const made = el("button", { type: "button" }, text);
  const back = () => { timer = 0; made.textContent = text; made.classList.remove("sure"); };
  made.onclick = () => {
    if (timer) { clearTimeout(timer); back(); act(); return; }
    made.textContent = `sure? ${text}`;
    made.classList.add("sure");
    speak(`press again: ${text}`);
    timer = setTimeout(back, 4000);
  };
  return made;
}

/** For readers of the screen. */
export function speak(text) { $("spoken").textContent = text; }

let colours = {};
const probe = el("span", { hidden: true });

/** The colour that the style sheet has for `name` in the present theme. */
export function colour(name) {
  if (!(name in colours)) {
    if (!probe.isConnected) document.body.append(probe);
    probe.style.color = `var(--${name}, var(--ink))`;
    colours[name] = getComputedStyle(probe).color;
  }
  return colours[name];
}

export function forgetColours() { colours = {}; }

/** Fits a canvas to its size on the screen; gives its context, in CSS pixels, emptied. */
export function prepared(canvas) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  return [g, w, h];
}

/** Pan and zoom of an element by pointer, wheel and keys: on screen, x = k · world x + this.x; `taken()`: by hand. */
export class View {
  constructor(element, changed) {
    Object.assign(this, { element, changed, x: 0, y: 0, k: 1, moved: false, home: null });
    const held = new Map();
    let dragged = false;
    element.addEventListener("pointerdown", (e) => { held.set(e.pointerId, e); dragged = held.size > 1; });
    element.addEventListener("pointermove", (e) => {
      const last = held.get(e.pointerId);
      if (!last) return;
      const dx = e.clientX - last.clientX, dy = e.clientY - last.clientY;
      if (!dragged && Math.hypot(dx, dy) < 4) return;
      if (!dragged) { dragged = true; element.setPointerCapture(e.pointerId); }
      const [other] = [...held.values()].filter((p) => p.pointerId !== e.pointerId);
      if (other) {
        const far = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
        this.zoom(far(e) / far(last), other);
      } else this.pan(dx, dy);
      held.set(e.pointerId, e);
    });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, (e) => held.delete(e.pointerId));
    element.addEventListener("click", (e) => { if (dragged) e.stopImmediatePropagation(); dragged = false; }, true);
    element.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY / 500), e); }, { passive: false });
    element.addEventListener("keydown", (e) => this.key(e));
    new ResizeObserver(() => { if (this.moved || !this.home) changed(); else this.fit(...this.home); }).observe(element);
  }

  key(e) {
    if (e.target !== this.element || e.ctrlKey || e.metaKey || e.altKey) return;
    const step = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] }[e.key];
    if (step && e.shiftKey) this.pan(...step);
    else if (e.key === "+" || e.key === "=") this.zoom(1.25);
    else if (e.key === "-") this.zoom(0.8);
    else if (e.key === "0" && this.home) this.fit(...this.home);
    else return;
    e.preventDefault();
  }

  pan(dx, dy) { this.x += dx; this.y += dy; this.moved = true; this.taken?.(); this.changed(); }

  zoom(factor, at) {
    const box = this.element.getBoundingClientRect();
    const px = at ? at.clientX - box.x : box.width / 2, py = at ? at.clientY - box.y : box.height / 2;
    const k = Math.min(Math.max(this.k * factor, 0.02), 2000), f = k / this.k;
    Object.assign(this, { k, x: px - (px - this.x) * f, y: py - (py - this.y) * f, moved: true });
    this.taken?.();
    this.changed();
  }

  /** Shows a box of the world, with y down, whole; at most at scale `most`. */
  fit(x0, y0, x1, y1, most = Infinity) {
    const w = this.element.clientWidth, h = this.element.clientHeight;
    if (!w || !h) { this.home = [x0, y0, x1, y1, most]; return; }
    this.k = Math.min(w / (x1 - x0), h / (y1 - y0), most);
    Object.assign(this, { home: [x0, y0, x1, y1, most], moved: false });
    this.centre((x0 + x1) / 2, (y0 + y1) / 2);
  }

  centre(wx, wy) {
    this.x = this.element.clientWidth / 2 - wx * this.k;
    this.y = this.element.clientHeight / 2 - wy * this.k;
    this.changed();
  }
}
