// The page: what the server says is kept here, and shown by the panes in the next frame.

import { Chart } from "./chart.js";
import { Details } from "./details.js";
import { $, el, redraw, seconds, speak } from "./dom.js";
import { Link } from "./link.js";
import { RoomMap } from "./map.js";
import { Operator, told } from "./operator.js";
import { Signals } from "./signals.js";
import { Timeline } from "./timeline.js";

const LOG = 300;

const app = {
  figures: [], hello: { mode: "", signals: [], layers: [] }, states: [{}], charts: [], at: 0,
  get state() { return this.states[0]; },
  get live() { return this.hello.mode === "live"; },
  get seekable() { return this.hello.seek ?? this.hello.mode === "record"; },
  /** Whether this page may give commands: it holds control, or nobody does and it knows the token. */
  get steers() { const o = this.state.operator; return Boolean(this.live && this.hello.commands && (o?.you || (operator.known && !o?.name))); },
  now: () => app.at,
  moved: () => moved(),
  send: (message) => link.send(message),
  command: (what, more) => operator.command(what, more),
  log(text, kind = "") {
    const list = $("log"), end = list.scrollHeight - list.scrollTop - list.clientHeight < 30;
    list.append(el("li", { className: kind }, text));
    while (list.children.length > LOG) list.firstChild.remove();
    if (end) list.scrollTop = list.scrollHeight;
  },
};

const details = new Details(app), operator = new Operator(app), map = new RoomMap(app.send);
const signals = app.signals = new Signals(app), timeline = app.timeline = new Timeline(app);
map.view.taken = () => { $("map-follow").checked = false; };
$("map-follow").onchange = () => redraw(map.draw);

function chartOf(slot) {
  if (app.charts[slot]) return app.charts[slot];
  const root = el("div", { className: "chart", "aria-label": slot ? "second chart" : "chart", role: "group" });
  $("charts").append(root);
  const chart = new Chart(root, slot, (path, outcome) => picked(path, outcome, slot), app.now, app.send);
  chart.view.taken = () => { $("chart-follow").checked = false; };
  return app.charts[slot] = chart;
}

function picked(path, outcome, slot = 0) {
  app.charts.forEach((c, i) => c.mark(i === slot ? path : null));
  details.pick(path, outcome, slot);
}

// -- what the server says

const heard = {
  hello(m) {
    const again = app.hello.mode !== "";
    Object.assign(app, { hello: m, states: [{}], at: 0, figures: [] });
    document.body.dataset.mode = m.mode;
    document.body.classList.toggle("seekable", app.seekable);
    $("title").textContent = m.title;
    $("about").textContent = (m.about ?? []).join(" · ");
    $("about").title = $("about").textContent;
    $("stop-is").textContent = m.stop_is ?? "a software stop, not a safety device";
    $("profile").replaceChildren(...(m.profiles ?? []).map((p) => el("option", { value: p }, p)));
    namesOf(m.charts ?? []);
    $("operator").hidden = m.mode === "record" || (m.mode === "charts" && !m.commands);
    $("speed-label").hidden = m.mode === "live" && (m.real || !m.commands);
    timeline.clear();
    map.layers(m.layers ?? []);
    signals.list(m.signals ?? []);
    operator.lost();
    operator.unlock();
    if (again && link.found) app.log("connected again");
    link.found = false;
    redraw(shown);
  },
  chart(m) {
    const chart = chartOf(m.slot ?? 0);
    chart.show(m);
    if (!m.slot) {
      $("first").value = m.name;
      if (m.profile) $("profile").value = m.profile;
      $("chart-head").textContent = m.name;
      $("paths").replaceChildren(...Object.keys(m.nodes ?? {}).filter(Boolean).map((p) => el("option", { value: p })));
    }
    listFindings();
    redraw(shown);
  },
  charts: (m) => namesOf(m.charts),
  room: (m) => m.slot || map.show(m),
  state(m) {
    const slot = m.slot ?? 0, first = app.states[slot]?.at === undefined;
    app.states[slot] = m;
    redraw(shown);
    if (slot) return;
    app.at = m.at;
    if (app.hello.mode === "record") for (const list of ["log", "shadow"]) $(list).replaceChildren();
    if (first || app.hello.mode === "record") for (const entry of m.last ?? []) happened(entry);
    timeline.playingAt(m.paused ? 0 : m.speed ?? 0);
  },
  ev(m) {
    const { t, last, slot = 0, ...changed } = m;
    Object.assign(app.states[slot] ??= {}, changed);
    if (!slot) app.at = Math.max(app.at, m.at ?? 0);
    if (!last && Object.keys(changed).every((k) => k === "at")) return redraw(moved);
    for (const entry of last ?? []) {
      happened(entry, /error|fault|stop/.test(entry.kind) ? "error" : "");
      const { child, outcome } = entry;
      if (child) app.charts[slot]?.taken(entry.path ? `${entry.path}/${child}` : child, outcome);
    }
    if (!slot && ("speed" in m || "paused" in m)) timeline.playingAt(app.state.paused ? 0 : app.state.speed ?? 0);
    redraw(shown);
  },
  frame(m) { if (!m.slot) app.at = m.at; map.frame(m); redraw(moved); },
  health: (m) => { app.health = m; redraw(healthy); },
  figures(m) {
    if ((timeline.range && !m.range) || JSON.stringify(app.figures[m.slot ?? 0]) === JSON.stringify(m)) return;
    app.figures[m.slot ?? 0] = m;
    redraw(figured);
  },
  lanes: (m) => timeline.show(m, false),
  "lanes+": (m) => timeline.show(m, true),
  plot: (m) => signals.show(m),
  ack: (m) => operator.acknowledged(m),
  say: (m) => app.log(m.text),
};

// -- what is shown

/** A line of the log, and, where a shadow decided otherwise, of its list. */
function happened(entry, kind = "") {
  app.log(told(entry), kind);
  if (entry.kind !== "shadow") return;
  $("shadow-box").hidden = false;
  $("shadow").append(el("li", {}, told(entry)));
}

let spoken = "";

function shown() {
  const s = app.state;
  $("fold").textContent = app.charts[0]?.allClosed ? "unfold all" : "fold all";
  app.charts.forEach((c, slot) => c.light(app.states[slot] ?? {}));
  if ($("chart-follow").checked && app.hello.mode !== "charts") for (const c of app.charts) c.follow();
  operator.show();
  details.show();
  const doing = [s.ended ? `ended: ${s.ended}` : "", s.stop ? "stopped" : "", s.paused ? "paused" : "", ...(s.faults ?? []), (app.charts[0]?.doing ?? []).join(", ")].filter(Boolean).join(" · ");
  $("doing").textContent = $("doing").title = doing;
  if (doing !== spoken) speak(doing);
  spoken = doing;
  $("doing").className = s.stop || s.faults?.length ? "error" : "";
  document.title = `${s.stop ? "■ " : ""}${app.hello.title ?? "cobodeck"}`;
  warn();
  moved();
}

/** What goes on with time alone. */
function moved() {
  $("clock").textContent = seconds(app.at) + (app.hello.until ? ` of ${seconds(app.hello.until)}` : "");
  for (const c of app.charts) c.timed();
  timeline.draw();
}

/** Charts that can be chosen, by name or as the server tells of them. */
function namesOf(charts) {
  $("second-names").replaceChildren(...charts.map((c) => el("option", { value: c.name ?? c })));
  const told = charts.filter((c) => c.file);
  $("charts-box").hidden = told.length < 2;
  $("chart-list").replaceChildren(...told.map((c) => {
    const found = [c.errors ? `${c.errors} errors` : "", c.warnings ? `${c.warnings} warnings` : ""].filter(Boolean).join(", ");
    return el("li", {}, el("button", { type: "button", title: c.file, onclick: () => app.send({ t: "show", chart: c.name, slot: 0 }) }, c.name), found ? el("small", { className: c.errors ? "error" : "warning" }, ` ${found}`) : null);
  }));
}

function warn() {
  const stale = app.charts.some((c) => c.message?.stale), urgent = $("banner").classList.contains("urgent") && !link.up;
  const text = urgent ? "STOP WAS NOT SENT: there is no connection. Use the emergency stop of the robot."
    : app.state.over ? "The run is over; this is what it was at its end."
    : !link.up && app.hello.mode ? "The connection is lost; what you see is old. Trying again …"
      : (app.charts.find((c) => c.message?.trouble)?.message.trouble ?? "") || (stale ? "The text is broken: this is the last good picture." : "");
  $("banner").hidden = !text;
  if ($("banner").textContent !== text) $("banner").textContent = text;
  if (link.up) $("banner").classList.remove("urgent");
  $("banner").classList.toggle("over", Boolean(app.state.over) && !urgent);
}

function listFindings() {
  const all = app.charts.flatMap((c, slot) => (c.message?.findings ?? []).map((f) => ({ ...f, slot })));
  $("findings-box").hidden = !all.length && app.hello.mode !== "charts";
  $("findings-head").textContent = all.length ? `Findings: ${all.length}` : "No findings";
  $("findings").replaceChildren(...all.map((f) => {
    const place = [f.file, f.line, f.column].filter((v) => v !== null && v !== undefined).join(":");
    const button = el("button", { type: "button", className: f.severity, onclick: () => { if (f.path !== null) { picked(f.path, null, f.slot); app.charts[f.slot].zoomTo(f.path); } navigator.clipboard?.writeText(place).catch(() => {}); where.hidden = false; } }, el("b", {}, `${f.severity} ${f.code} `), f.message);
    const where = el("code", { hidden: app.hello.mode !== "charts" }, place);
    return el("li", {}, button, where, f.hint ? el("small", {}, f.hint) : null);
  }));
}

function table(rows) { return el("table", {}, el("tbody", {}, ...rows.map(([k, ...v]) => el("tr", {}, el("th", { scope: "row" }, k), ...v.map((x) => el("td", {}, String(x))))))); }

function figured() {
  const [one, two] = app.figures, range = one?.range;
  const beside = new Map(two?.rows ?? []);
  $("figures").replaceChildren(el("p", {}, range ? `of ${seconds(range[0])} – ${seconds(range[1])}` : "of the whole run"),
    table([...(two ? [["record", 1, 2]] : []), ...(one?.rows ?? []).map(([k, v]) => (two ? [k, v, beside.get(k) ?? ""] : [k, v]))]));
}

function healthy() {
  const h = app.health, some = (v, unit = "") => (v === null || v === undefined ? "–" : `${v}${unit}`);
  $("health").replaceChildren(table([
    ["late ticks", some(h.late)], ["missed ticks", some(h.missed)], ["tick, 99 of 100", some(h.tick_p99_ms, " ms")], ["pages", some(h.pages)], ["dropped for pages", some(h.dropped)],
    ...Object.entries(h.gates ?? {}), ...(h.children ?? []).map((c) => [c.name, c.state]),
    ...Object.entries(h.ages ?? {}).map(([k, v]) => [`age of ${k}`, v === null ? "–" : `${v.toFixed(2)} s`]),
  ]));
}

// -- the page itself

const THEMES = ["", "light", "dark"];
function theme(name) {
  document.documentElement.style.colorScheme = name;
  $("theme").title = $("theme").ariaLabel = `colours: ${name || "as the system"}`;
  try { localStorage.theme = name; } catch { /* storage is off: for this visit only */ }
  map.recoloured();
  redraw(timeline.draw);
}
$("theme").onclick = () => theme(THEMES[(THEMES.indexOf(document.documentElement.style.colorScheme) + 1) % 3]);
$("legend").open = innerWidth > 700;
try { theme(localStorage.theme ?? ""); } catch { theme(""); }

$("fold").onclick = () => { for (const c of app.charts) c.foldAll(); redraw(shown); };
$("chart-fit").onclick = () => { $("chart-follow").checked = false; for (const c of app.charts) if (c.view.home) c.view.fit(...c.view.home); };
$("chart-follow").onchange = () => redraw(shown);
$("find").onchange = () => { const path = $("find").value; if (app.charts[0]?.boxes?.has(path)) { $("chart-follow").checked = false; picked(path, null); app.charts[0].zoomTo(path); } };
$("profile").onchange = () => app.send({ t: "profile", name: $("profile").value, slot: 0 });
$("first").onchange = () => app.send({ t: "show", chart: $("first").value.trim(), slot: 0 });
$("second").onchange = () => {
  const chart = $("second").value.trim() || null;
  if (!chart && app.charts[1]) { app.charts[1].root.remove(); app.charts.length = 1; listFindings(); }
  app.send({ t: "second", chart });
};

addEventListener("keydown", (e) => {
  if (e.defaultPrevented || e.ctrlKey || e.metaKey || e.altKey || /INPUT|TEXTAREA|SELECT/.test(e.target.tagName) && e.target.id !== "slider") return;
  if (e.key === "ArrowLeft" && app.seekable) timeline.step(-1);
  else if (e.key === "ArrowRight" && app.seekable) timeline.step(1);
  else if (e.key === " " && app.seekable && !/BUTTON|SUMMARY/.test(e.target.tagName)) timeline.play(!timeline.playing);
  else if (e.key === "[") timeline.edge(0);
  else if (e.key === "]") timeline.edge(1);
  else if (e.key === "/") $("find").focus();
  else return;
  e.preventDefault();
});

const link = new Link((m) => heard[m.t]?.(m), (up, reason) => {
  $("link").textContent = up ? "connected" : `no connection${reason ? `: ${reason}` : ""}`;
  document.body.classList.toggle("lost", !up);
  if (!up) { app.state.operator = { name: app.state.operator?.name ?? null, you: false }; operator.lost(); operator.show(); }
  warn();
});
