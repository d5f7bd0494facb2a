// What all panes share: elements, texts of times, one animation frame for all, colours, what is said aloud.

export const $ = (id) => document.getElementById(id);

/** A new element; names with a dash, `role` and `list` are attributes, the others properties. */
export function el(tag, props = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) {
    if (key.includes("-") || key === "role" || key === "list") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...there(children));
  return made;
}

/** Of children, those that are there: neither null nor undefined nor false. */
const there = (children) => [children].flat(Infinity).filter((c) => c !== null && c !== undefined && c !== false);

/** A text with its numbers in six digits, as far as anybody reads them. */
export const short = (text) => String(text).replace(/\d+\.\d{5,}/g, (n) => Number(Number(n).toPrecision(6)));

/** Names and values, side by side. */
export function pairs(object) {
  const rows = Object.entries(object);
  return rows.length > 0 && el("dl", {}, rows.map(([k, v]) => [el("dt", {}, k), el("dd", {}, short(v))]));
}

const filled = new WeakMap();

/** Fills `box` anew with what `build` makes if what it shows has changed; the focus stays at its place. */
export function fill(box, shows, build) {
  const key = JSON.stringify(shows);
  if (filled.get(box) === key) return;
  filled.set(box, key);
  const places = () => [...box.querySelectorAll("button, input, select, textarea, summary")];
  const held = places().indexOf(document.activeElement);
  box.replaceChildren(...there(build()));
  if (held >= 0) places().at(Math.min(held, places().length - 1))?.focus();
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

export const button = (text, act, props = {}) => el("button", { type: "button", onclick: act, ...props }, text);

/** A button that does `act` when pressed again within 4 s; not before it is `ready`. */
export function sure(text, act, ready = () => true) {
  let timer = 0;
  const made = button(text, () => {
    if (!ready()) return;
    if (timer) { back(); act(); return; }
    made.textContent = `sure? ${text}`;
    made.classList.add("sure");
    speak(`press again: ${text}`);
    timer = setTimeout(back, 4000);
  });
  const back = () => {
    clearTimeout(timer);
    timer = 0;
    made.textContent = text;
    made.classList.remove("sure");
  };
  return made;
}

const PAUSE_MS = 1500;
let said = "", saying = 0, lastSaid = -PAUSE_MS;

/** For readers of the screen: the newest, at most once in a pause. */
export function speak(text) {
  said = text;
  saying ||= setTimeout(() => {
    saying = 0;
    lastSaid = performance.now();
    $("spoken").textContent = said;
  }, Math.max(0, lastSaid + PAUSE_MS - performance.now()));
}

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
