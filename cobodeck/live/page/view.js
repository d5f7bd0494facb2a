// Pan and zoom by pointer, wheel and keys.

/** Of an element: on screen, x = k · world x + this.x. `changed()` draws; `taken()`: it was moved by hand. */
export class View {
  constructor(element, changed) {
    Object.assign(this, { element, changed, x: 0, y: 0, k: 1, moved: false, home: null, taken: () => {} });
    this.pointer();
    element.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(Math.exp(-e.deltaY / 500), e);
    }, { passive: false });
    element.addEventListener("keydown", (e) => this.key(e));
    new ResizeObserver(() => { if (this.moved || !this.home) changed(); else this.whole(); }).observe(element);
  }

  /** One pointer pans, two zoom; what was a drag is no click. */
  pointer() {
    const { element } = this, held = new Map();
    let dragged = false;
    element.addEventListener("pointerdown", (e) => { held.set(e.pointerId, e); dragged = held.size > 1; });
    element.addEventListener("pointermove", (e) => {
      const last = held.get(e.pointerId);
      if (!last) return;
      const dx = e.clientX - last.clientX, dy = e.clientY - last.clientY;
      if (!dragged && Math.hypot(dx, dy) < 4) return;
      if (!dragged) { dragged = true; element.setPointerCapture(e.pointerId); }
      const other = [...held.values()].find((p) => p.pointerId !== e.pointerId);
      if (other) {
        const far = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
        this.zoom(far(e) / far(last), other);
      } else this.pan(dx, dy);
      held.set(e.pointerId, e);
    });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, (e) => held.delete(e.pointerId));
    element.addEventListener("click", (e) => { if (dragged) e.stopImmediatePropagation(); dragged = false; }, true);
  }

  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const step = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] }[e.key];
    if (step && e.shiftKey) this.pan(...step);
    else if (e.key === "+" || e.key === "=") this.zoom(1.25);
    else if (e.key === "-") this.zoom(0.8);
    else if (e.key === "0") this.whole();
    else return;
    e.preventDefault();
  }

  pan(dx, dy) {
    Object.assign(this, { x: this.x + dx, y: this.y + dy, moved: true });
    this.taken();
    this.changed();
  }

  zoom(factor, at) {
    const box = this.element.getBoundingClientRect();
    const px = at ? at.clientX - box.x : box.width / 2, py = at ? at.clientY - box.y : box.height / 2;
    const k = Math.min(Math.max(this.k * factor, 0.02), 2000), f = k / this.k;
    Object.assign(this, { k, x: px - (px - this.x) * f, y: py - (py - this.y) * f, moved: true });
    this.taken();
    this.changed();
  }

  /** From now on the whole is this box of the world, with y down, at most at scale `most`. */
  wholeIs(x0, y0, x1, y1, most = Infinity) { this.home = [x0, y0, x1, y1, most]; }

  whole() {
    if (!this.home) return;
    this.show(...this.home);
    this.moved = false;
  }

  /** Shows a box of the world as large as it fits, at most at scale `most`. */
  show(x0, y0, x1, y1, most = Infinity) {
    const w = this.element.clientWidth, h = this.element.clientHeight;
    if (!w || !h) return;
    Object.assign(this, { k: Math.min(w / (x1 - x0), h / (y1 - y0), most), moved: true });
    this.x = (w - (x0 + x1) * this.k) / 2;
    this.y = (h - (y0 + y1) * this.k) / 2;
    this.changed();
  }
}
