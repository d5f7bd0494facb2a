// Commands to the run. Stop goes at once and asks nothing; all else needs the token.

import { $, button, el, fill, sure } from "./dom.js";

const BEAT_MS = 200;
const UNSENT = "NOT SENT, there is no connection", INSTEAD = ". Use the emergency stop of the robot.";
const ANYWHERE = /^(0\.0\.0\.0|\[::\])$/;  // what a server has that listens on all addresses
const LARGEST = 60000;  // of a chart, bytes; a server takes messages of 64 kB
const LEVELS = { "": "only locks ask", off: "off", low: "low", high: "high", full: "full" };

export class Operator {
  constructor(app) {
    Object.assign(this, { app, asked: 0, known: false, waiting: new Map(), credentials: null });
    $("stop").onclick = () => this.stop();
    addEventListener("keydown", (e) => {
      if (e.key !== "Escape" || !app.live) return;
      e.preventDefault();
      this.stop();
    }, true);
    $("auth").onsubmit = (e) => {
      e.preventDefault();
      this.credentials = { token: $("token").value, name: $("name").value };
      $("token").value = "";
      this.unlock();
    };
    setInterval(() => { if (app.live && app.state.operator?.you) app.send({ t: "beat" }); }, BEAT_MS);
  }

  /** Tells the server who this is; again after each reconnection, from memory alone. */
  unlock() { if (this.credentials) this.app.send({ t: "auth", ...this.credentials }); }

  stop() {
    if (!this.app.live) return;
    this.app.unsent = !this.command("stop");
    this.app.warn();
  }

  /** Sends a command; the answer is shown. False, and said, if there is no connection. */
  command(what, more = {}) {
    const id = ++this.asked, sent = this.app.send({ t: "cmd", id, do: what, ...more });
    const text = [what, more.path, more.outcome].filter(Boolean).join(" ");
    if (sent) this.waiting.set(id, text);
    this.answer(sent, `${text}: ${sent ? "sent" : UNSENT}${sent || what !== "stop" ? "" : INSTEAD}`);
    return sent;
  }

  acknowledged({ id, ok, text, url }) {
    const what = this.waiting.get(id);
    this.waiting.delete(id);
    if (!id) this.known = ok;  // the answer to `auth` has no number
    if (!id && !ok) this.credentials = null;
    this.answer(ok, [what, text || (ok ? "done" : "refused")].filter(Boolean).join(": "));
    const at = url && new URL(url);
    if (at && ANYWHERE.test(at.hostname)) at.hostname = location.hostname;
    if (at?.protocol.startsWith("http")) {
      $("answer").append(" ", el("a", { href: at.href, target: "_blank", rel: "noopener" }, "open its page"));
    }
    this.show();
  }

  answer(ok, text) {
    $("answer").textContent = text;
    $("answer").className = ok ? "" : "error";
    this.app.log(text, ok ? "" : "error");
  }

  lost() {
    this.waiting.clear();
    this.known = false;
  }

  /** What can be done now. */
  show() {
    const { hello, steers, live, charts } = this.app, s = this.app.state, message = charts[0]?.message;
    $("stop").classList.toggle("pulled", Boolean(s.stop));
    $("stop").firstChild.textContent = s.stop ? "STOPPED " : "STOP ";
    $("holder").textContent = this.holder(s.operator, hello);
    $("auth").hidden = this.known || !hello.commands;
    fill($("waiting"), [s.waiting, steers], () => this.consent(s.waiting ?? {}, steers));
    fill($("control"), [live && this.known, s.operator], () => live && this.known && this.control(s.operator ?? {}));
    fill($("tools"), [steers, hello.real, s.paused, s.level], () => steers && this.tools(s, hello.real));
    $("replace").hidden = !steers;  // what is typed there outlasts a lost connection, and control
    fill($("replace"), live && hello.about, () => live && this.replace());
    const starts = hello.mode === "charts" && message;
    $("start").hidden = !this.known;  // typed text outlasts a lost connection here, too
    fill($("start"), starts && [message.name, message.form], () => starts && this.start(message));
  }

  holder(operator, { mode, on_parts: parts }) {
    if (operator?.you) {
      const keep = parts ? " Keep this tab in front: half a second without it stops the robot." : "";
      return `You hold control as ${operator.name}.${keep}`;
    }
    if (operator?.name) return `${operator.name} holds control.`;
    return mode === "live" ? "Nobody holds control." : "";
  }

  button(text, what, more) { return button(text, () => this.command(what, more)); }

  sure(what) { return sure(what, () => this.command(what)); }

  consent(waiting, steers) {
    return Object.entries(waiting).map(([path, outcome]) => el("li", {}, `${path}: ${outcome} waits for consent `,
      steers && ["consent", "refuse"].map((what) => this.button(what, what, { path, outcome }))));
  }

  control({ you, name }) {
    if (you) return this.button("give control back", "release");
    return name ? sure(`take over from ${name}`, () => this.command("take")) : this.button("take control", "take");
  }

  tools({ paused, level }, real) {
    const choice = el("select", { onchange: () => this.command("level", { level: choice.value || null }) },
      Object.entries(LEVELS).map(([value, text]) => el("option", { value, selected: value === (level ?? "") }, text)));
    return [
      paused ? this.button("resume", "resume") : this.button("pause", "pause"),
      this.button("step", "step"),
      this.button("acknowledge", "ack"),
      real ? el("small", {}, "reset: at the console") : this.sure("reset"),
      this.sure("preempt"), this.sure("end"),
      el("label", {}, "autonomy ", choice),
    ];
  }

  /** A form that begins with the text of a chart as it runs now, asked for when it is opened. */
  replace() {
    const text = el("textarea", { rows: 12, spellcheck: false, placeholder: "chart: …" });
    const ask = (name) => {
      this.change.before = text.value;
      this.app.send({ t: "text", chart: name });
    };
    const chart = el("select", { onchange: () => ask(chart.value), "aria-label": "chart to change" });
    const file = el("input", { type: "file", accept: ".yaml,.yml" });
    text.ariaLabel = "YAML of the chart";
    file.ariaLabel = "file of the chart";
    file.onchange = async () => { text.value = await file.files[0].text(); };
    this.change = { text, chart };
    const begin = (e) => { if (e.target.open && !text.value) ask(); };
    const fits = () => {
      const long = new Blob([JSON.stringify(text.value)]).size > LARGEST;
      if (long) this.answer(false, `replace: the text is too long, at most ${LARGEST / 1000} kB`);
      return !long;
    };
    const form = el("div", { className: "form" },
      chart, file, text, sure("replace", () => this.command("replace", { text: text.value }), fits));
    return el("details", { ontoggle: begin }, el("summary", {}, "change the running chart"), form);
  }

  /** The text of a chart that runs, to begin a change with; it does not replace what was typed meanwhile. */
  runs({ chart, text, charts }) {
    if (!this.change) return;
    const names = charts.map((name) => el("option", { value: name, selected: name === chart }, name));
    this.change.chart.replaceChildren(...names);
    if (this.change.text.value === this.change.before) this.change.text.value = text;
  }

  /** A form for what the chart that is shown declares. */
  start({ name, form }) {
    const { scenes, users } = this.app.hello, field = (label, input) => el("label", {}, `${label} `, input);
    const list = (id, names) => el("datalist", { id }, (names ?? []).map((n) => el("option", { value: n })));
    const scene = el("input", { list: "scenes" }), user = el("input", { list: "users" });
    const fields = (form ?? []).map((f) => {
      const required = f.default === null;
      return [f, el("input", { placeholder: required ? f.what : f.default, title: f.about, required })];
    });
    const of = (kind) => Object.fromEntries(
      fields.filter(([f, input]) => f.kind === kind && input.value).map(([f, input]) => [f.name, input.value]));
    const go = () => this.command("start", {
      chart: name, parameters: of("parameter"), inputs: of("input"), scene: scene.value, user: user.value,
    });
    const box = el("form", { className: "form", onsubmit: (e) => e.preventDefault() },
      field("scene", scene), field("user", user), list("scenes", scenes), list("users", users),
      fields.map(([f, input]) => field(`${f.name}${f.unit ? `, ${f.unit}` : ""}`, input)),
      sure("start", go, () => box.reportValidity()));
    return el("details", {}, el("summary", {}, `start ${name}`), box);
  }
}
