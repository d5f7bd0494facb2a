// What stands over the shapes of a chart: breakpoints, locks, findings, times, buttons to fold.

import { seconds } from "./dom.js";
import { shape } from "./picture.js";

const NARROW = 150;  // units of the drawing; in a narrower box the time would stand on its name

/** All marks of a chart, and of the texts that go on with time, what they tell. */
export function marksOf(chart) {
  const clocks = [...clocksOf(chart)];
  return { marks: [...badges(chart), ...folders(chart), ...clocks.map(([text]) => text)], clocks };
}

function* badges(chart) {
  for (const path of chart.breaks) yield* badge(chart, path, "break", "", "breakpoint", false);
  for (const path of chart.state.locks ?? []) yield* badge(chart, path, "lock", "L", "locked");
  for (const [path, outcome] of Object.entries(chart.state.waiting ?? {})) {
    yield* badge(chart, path, "wait", "?", `${outcome} waits for consent`);
  }
  for (const [path, found] of Map.groupBy(chart.message.findings ?? [], (f) => f.path)) {
    const severity = found.some((f) => f.severity === "error") ? "error" : found[0].severity;
    const text = found.map((f) => `${f.code}: ${f.message}`).join("\n");
    yield* badge(chart, path, severity, String(found.length), text);
  }
}

function* badge(chart, path, name, text, about, right = true) {
  const b = path !== null && chart.shown(path) === path && chart.picture.bounds(path);
  if (!b) return;
  const at = `translate(${b.x + (right ? b.width : 0)} ${b.y})`;
  yield shape("g", { class: `badge ${name}`, transform: at, "data-path": path },
    shape("circle", { r: 6 }), shape("text", { y: 3.2, "text-anchor": "middle" }, text), shape("title", {}, about));
}

function* folders(chart) {
  for (const path of chart.picture.boxes.keys()) {
    const closed = chart.closed(path);
    const b = path && chart.foldable(path) === path && chart.shown(path) === path && chart.picture.bounds(path);
    if (!b) continue;
    const at = `translate(${b.x + b.width - 13} ${b.y + 13})`;
    yield shape("g", { class: "folder", transform: at, "data-fold": path },
      shape("rect", { x: -7, y: -7, width: 14, height: 14, rx: 3 }),
      shape("text", { y: 4, "text-anchor": "middle" }, closed ? "+" : "−"),
      shape("title", {}, closed ? "unfold" : "fold"));
  }
}

/** Texts with the time that a node has been active; in the middle of a box that hides it, with what runs in there.
 * Boxes around have theirs beside their names, if there is room; guards begin with their box, and have none. */
function* clocksOf(chart) {
  for (const [path, time] of chart.times) {
    const b = chart.picture.bounds(path);
    if (!b) continue;
    const badge = chart.state.locks?.includes(path) ? 10 : 0;
    const inside = time.below && chart.picture.frames.has(path);
    const at = inside
      ? { x: b.x + b.width / 2, y: b.y + b.height / 2, "text-anchor": "middle" }
      : { x: b.x + Math.max(b.width - 30, b.width / 2 + 6) - badge, y: b.y - 3 };  // beside an arrow to the middle
    yield [shape("text", { class: "since", ...at }), time];
  }
  for (const path of chart.around) {
    const b = chart.picture.bounds(path);
    if (!b || b.width < NARROW) continue;
    const at = { x: b.x + b.width - 24, y: b.y + 15, "text-anchor": "end" };
    yield [shape("text", { class: "since around", ...at }), { since: chart.state.active[path], below: "" }];
  }
}

/** Writes how long each has lasted at the instant `now`. */
export function tell(clocks, now) {
  for (const [text, { since, below }] of clocks) {
    const is = `${below ? `${below} · ` : ""}${seconds(Math.max(0, now - since))}`;
    if (text.textContent !== is) text.textContent = is;
  }
}
