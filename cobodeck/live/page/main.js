// The page: what the server says is kept here, and shown by the panes in the next frame.

import { Chart } from "./chart.js";
import { Details } from "./details.js";
import { $, button, el, redraw, seconds, speak } from "./dom.js";
import { Link } from "./link.js";
import { chartList, figureTable, findingList, healthTable } from "./lists.js";
import { Log } from "./log.js";
import { RoomMap } from "./map.js";
import { Operator } from "./operator.js";
import { nameOf } from "./picture.js";
import { Signals } from "./signals.js";
import { themed } from "./theme.js";
import { Timeline } from "./timeline.js";

const INSTANT = /(\d{4}-\d\d-\d\d)T(\d\d:\d\d)\S*/g;  // of which date and minute are shown

/** What a page shows as it is now, whatever instant it looks back at. */
const NOW = ["stop", "faults", "operator", "over", "paused", "speed", "level", "locks", "breaks", "ended"];
const ofNow = (state) => Object.fromEntries(NOW.filter((key) => key in state).map((key) => [key, state[key]]));

const app = {
  hello: { mode: "" }, states: [{}], charts: [], figures: [], health: [], at: 0,
  unsent: false,  // a stop could not be sent
  newest: 0,  // of the run, s
  back: false,  // an earlier instant of a run that goes on is shown
  get state() { return this.states[0]; },
  get live() { return this.hello.mode === "live"; },
  get recorded() { return this.hello.mode === "record"; },
  /** Whether this page may give commands: it holds control, or nobody does and it knows the token. */
  get steers() {
    const { operator: o } = this.state;
    return Boolean(this.live && !this.back && this.hello.commands && (o?.you || (operator.known && !o?.name)));
  },
  now: () => app.at,
  moved: () => moved(),
  shown: () => shown(),
  warn: () => warn(),
  send: (message) => link.send(message),
  command: (what, more) => operator.command(what, more),
  log: (text, kind) => log.line(text, kind),
  goTo: (path, slot) => goTo(path, slot),
};

const log = new Log(app), details = new Details(app), operator = new Operator(app), map = new RoomMap(app.send);
const signals = app.signals = new Signals(app), timeline = app.timeline = new Timeline(app);

/** The chart of a place; where charts are edited, each has a profile, and the second can be closed. */
function chartOf(slot) {
  if (app.charts[slot]) return app.charts[slot];
  const root = el("div", { className: "chart" }), name = el("b");
  const profile = el("select", { onchange: () => app.send({ t: "profile", name: profile.value, slot }) },
    (app.hello.profiles ?? []).map((p) => el("option", { value: p }, p)));
  const bar = el("div", { className: "bar charts-only" }, name, el("label", {}, "profile ", profile),
    slot > 0 && button("×", () => beside(null), { "aria-label": "close this chart" }));
  const place = el("div", { className: "place", role: "group", "aria-label": slot ? "second chart" : "chart" });
  place.append(bar, root);
  $("charts").append(place);
  const chart = new Chart(root, slot, (path, outcome) => picked(path, outcome, slot), app.now, app.send);
  Object.assign(chart, { place, name, profile, recorded: app.recorded });
  chart.view.taken = () => { $("chart-follow").checked = false; };
  return app.charts[slot] = chart;
}

function picked(path, outcome, slot = 0) {
  app.charts.forEach((c, i) => c.mark(i === slot ? path : null));
  details.pick(path, outcome, slot);
}

/** Shows another chart beside the first one, or none. */
function beside(chart) {
  if (!chart && app.charts[1]) {
    app.charts.pop().place.remove();
    listFindings();
  }
  app.send({ t: "second", chart });
}

/** Another run, record or folder: nothing is kept of the one before but the log. */
function anew() {
  Object.assign(app, { states: [{}], at: 0, newest: 0, figures: [], health: [] });
  healthy();
  timeline.clear();
  log.begin();
  operator.lost();
}

// -- what the server says

const heard = {
  hello(m) {
    const again = m.mode === "live" && JSON.stringify(m) === JSON.stringify(app.hello);  // the same run, after a drop
    for (const chart of app.charts.splice(m.mode === app.hello.mode ? 1 : 0)) chart.place.remove();
    Object.assign(app, { hello: m, back: false });
    if (!again) anew();
    document.body.dataset.mode = m.mode;
    $("title").textContent = m.title;
    $("about").title = (m.about ?? []).join(" · ");
    $("about").textContent = $("about").title.replaceAll(INSTANT, "$1 $2");
    $("stop-is").textContent = m.stop_is;
    $("operator").hidden = !m.commands;
    $("speed-label").hidden = m.mode === "live" && !(m.paced && m.commands);
    map.layers(m.layers ?? []);
    const all = [...(m.signals ?? []), ...(m.runs ?? []).flatMap((run) => run.signals)];
    signals.list([...new Map(all.map((signal) => [signal.name, signal])).values()]);
    if (!operator.known) operator.unlock();
    redraw(shown);
  },
  chart(m) {
    const chart = chartOf(m.slot ?? 0);
    chart.show(m);
    chart.name.textContent = m.name;
    chart.profile.value = m.profile ?? "";
    if (!m.slot) {
      const paths = Object.keys(m.nodes ?? {}).filter(Boolean);
      $("paths").replaceChildren(...paths.map((p) => el("option", { value: p })));
    }
    listFindings();
    redraw(shown);
  },
  charts(m) {
    const show = (chart) => app.send({ t: "show", chart, slot: 0 });
    $("chart-list").replaceChildren(...chartList(m.charts, show, beside));
  },
  room: (m) => map.show(m),
  state(m) {
    const slot = m.slot ?? 0;
    if (m.back && !app.back) return;
    app.states[slot] = m.back ? { ...m, ...ofNow(app.state) } : m;
    redraw(shown);
    if (app.recorded) log.anew(); else if (!m.back) log.news(m);
    if (slot) return;
    app.at = m.at;
    if (m.back) return;
    app.newest = Math.max(app.newest, m.at);
    timeline.playingAt(m.paused ? 0 : m.speed ?? 0);
  },
  ev(m) {
    const { t, last = [], slot = 0, ...all } = m, changed = app.back ? ofNow(all) : all;
    Object.assign(app.states[slot] ??= {}, changed);
    if (!slot) app.newest = Math.max(app.newest, m.at ?? 0);
    if (!slot && !app.back) app.at = Math.max(app.at, m.at ?? 0);
    for (const entry of last) {
      const { at, child, outcome, path } = entry;
      log.add(entry, slot);
      if (child) timeline.moves.add(at);
      if (child && !app.back) app.charts[slot]?.taken(path ? `${path}/${child}` : child, outcome);
    }
    if (!slot && ("speed" in m || "paused" in m)) timeline.playingAt(app.state.paused ? 0 : app.state.speed ?? 0);
    redraw(Object.keys(changed).some((k) => k !== "at") ? shown : moved);
  },
  frame(m) {
    if (!m.slot && !m.back) app.newest = Math.max(app.newest, m.at);
    if (app.back === Boolean(m.back)) {
      if (!m.slot) app.at = m.at;
      map.frame(m);
    }
    redraw(moved);
  },
  health: (m) => { app.health[m.slot ?? 0] = m; redraw(healthy); },
  text: (m) => operator.runs(m),
  figures(m) {
    const slot = m.slot ?? 0;
    if ((timeline.range && !m.range) || JSON.stringify(app.figures[slot]) === JSON.stringify(m)) return;
    app.figures[slot] = m;
    redraw(figured);
  },
  lanes: (m) => timeline.show(m, false),
  "lanes+": (m) => timeline.show(m, true),
  shadow: (m) => log.differed(m),
  plot: (m) => signals.show(m),
  ack: (m) => operator.acknowledged(m),
  say: (m) => app.log(m.text),
};

// -- what is shown

let spoken = "";

function shown() {
  const s = app.state, { hello, charts } = app;
  $("to-now").hidden = !app.back;
  $("fold").textContent = charts[0]?.allClosed ? "unfold all" : "fold all";
  charts.forEach((c, slot) => c.light(app.states[slot] ?? {}));
  if ($("chart-follow").checked && hello.mode !== "charts") for (const c of charts) c.follow();
  operator.show();
  details.show();
  const doing = [
    s.ended && `ended: ${s.ended}`, s.stop && "stopped", s.paused && "paused", ...(s.faults ?? []),
    charts[0]?.doing.join(", "),
  ].filter(Boolean).join(" · ");
  $("doing").textContent = $("doing").title = doing;
  $("doing").className = s.stop || s.faults?.length ? "error" : "";
  if (doing !== spoken && !(app.recorded && timeline.playing) && !app.back) speak(spoken = doing);
  document.title = `${s.stop ? "■ " : ""}${hello.title ?? "cobodeck"}`;
  warn();
  moved();
}

/** What goes on with time alone. */
function moved() {
  $("clock").textContent = seconds(app.at) + (app.hello.until ? ` of ${seconds(app.hello.until)}` : "");
  for (const c of app.charts) c.timed();
  details.timed();
  timeline.draw();
}

function warn() {
  const text = warning();
  $("banner").hidden = !text;
  if ($("banner").textContent !== text) $("banner").textContent = text;
  $("banner").className = app.unsent ? "urgent" : app.back || app.state.over ? "over" : "";
}

function warning() {
  if (app.unsent) return "STOP WAS NOT SENT: there is no connection. Use the emergency stop of the robot.";
  const goes = app.state.over ? "is over" : "goes on";
  if (app.back) return `You look back at ${seconds(app.at)}; the run ${goes}.`;
  if (app.state.over) return "The run is over; this is what it was at its end.";
  if (!link.up && app.hello.mode) return "The connection is lost; what you see is old. Trying again …";
  const trouble = app.charts.find((c) => c.message?.trouble);
  if (trouble) return trouble.message.trouble;
  return app.charts.some((c) => c.message?.stale) ? "The text is broken: this is the last good picture." : "";
}

function listFindings() {
  const each = app.charts.flatMap((c, slot) => (c.message?.findings ?? []).map((f) => ({ ...f, slot })));
  const all = [...new Map(each.map((f) => [JSON.stringify({ ...f, slot: 0 }), f])).values()];  // of both charts once
  $("findings-box").hidden = app.hello.mode !== "charts";
  $("findings-head").textContent = all.length ? `Findings: ${all.length}` : "No findings";
  $("findings").replaceChildren(...findingList(all, goTo));
}

/** Shows a node and its details, if there is one. */
function goTo(path, slot = 0) {
  const chart = app.charts[slot];
  if (path === null || !chart?.picture) return;
  $("chart-follow").checked = false;
  picked(path, null, slot);
  chart.zoomTo(path);
}

const figured = () => $("figures").replaceChildren(...figureTable(app.figures));

function healthy() {
  $("health-box").hidden = !app.health.length;
  $("health").replaceChildren(healthTable(app.health));
}

// -- the page itself

themed(() => { map.recoloured(); redraw(timeline.draw); });
$("legend").open = innerWidth > 700;
map.view.taken = () => { $("map-follow").checked = false; };
$("map-follow").onchange = () => redraw(map.draw);
$("fold").onclick = () => { for (const c of app.charts) c.foldAll(); redraw(shown); };
$("chart-fit").onclick = () => { $("chart-follow").checked = false; for (const c of app.charts) c.view.whole(); };
$("chart-follow").onchange = () => redraw(shown);
$("find").onchange = () => {
  const wanted = $("find").value.trim(), paths = Object.keys(app.charts[0]?.message.nodes ?? {}).filter(Boolean);
  const path = [wanted, ...paths.filter((p) => nameOf(p) === wanted), ...paths.filter((p) => p.includes(wanted))]
    .find((p) => paths.includes(p));
  $("find").classList.toggle("error", Boolean(wanted && !path));
  if (!wanted || !path) return;
  $("find").value = "";
  goTo(path);
  app.charts[0].stopAt(path, true);
};

const KEYS = {
  ArrowLeft: () => timeline.step(-1),
  ArrowRight: () => timeline.step(1),
  n: () => timeline.now(),
  " ": () => app.recorded && timeline.play(!timeline.playing),
  "[": () => timeline.edge(0),
  "]": () => timeline.edge(1),
  "/": () => $("find").focus(),
};

addEventListener("keydown", (e) => {
  const { tagName, id } = e.target, typed = /INPUT|TEXTAREA|SELECT/.test(tagName) && id !== "slider";
  if (e.defaultPrevented || e.ctrlKey || e.metaKey || e.altKey || typed || !(e.key in KEYS)) return;
  if (e.key === " " && /BUTTON|SUMMARY/.test(tagName)) return;
  KEYS[e.key]();
  e.preventDefault();
});

const link = new Link((m) => heard[m.t]?.(m), (up, reason) => {
  $("link").textContent = up ? "connected" : `no connection${reason ? `: ${reason}` : ""}`;
  document.body.classList.toggle("lost", !up);
  if (up) {
    app.unsent = false;
    if (app.hello.mode) app.log("connected again");
  } else {
    app.state.operator = { name: app.state.operator?.name ?? null, you: false };
    operator.lost();
    redraw(shown);
  }
  warn();
});
