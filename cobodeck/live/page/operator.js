// Commands to the run. Stop goes at once and asks nothing; all else needs the token.

import { $, el, seconds, sure } from "./dom.js";

export class Operator {
  constructor(app) {
    Object.assign(this, { app, asked: 0, known: false, waiting: new Map(), credentials: null, key: "" });
    $("stop").onclick = () => this.stop();
    addEventListener("keydown", (e) => { if (e.key === "Escape" && app.live) { e.preventDefault(); this.stop(); } }, true);
    $("auth").onsubmit = (e) => { e.preventDefault(); this.credentials = { token: $("token").value, name: $("name").value }; $("token").value = ""; this.unlock(); };
    setInterval(() => { if (app.live && app.state.operator?.you) app.send({ t: "beat" }); }, 200);
  }

  /** Tells the server who this is; again after each reconnection, from memory alone. */
  unlock() { if (this.credentials) this.app.send({ t: "auth", ...this.credentials }); }

  stop() {
    if (this.app.live && !this.command("stop")) $("banner").classList.add("urgent");
  }

  /** Sends a command; the answer is shown. False, and said, if there is no connection. */
  command(what, more = {}) {
    const id = ++this.asked;
    const sent = this.app.send({ t: "cmd", id, do: what, ...more });
    const text = [what, more.path, more.outcome].filter(Boolean).join(" ");
    if (sent) this.waiting.set(id, text);
    this.answer(sent, sent ? `${text}: sent` : `${text}: NOT SENT, there is no connection. Use the emergency stop of the robot.`);
    return sent;
  }

  acknowledged({ id, ok, text, url }) {
    const what = this.waiting.get(id) ?? "";
    this.waiting.delete(id);
    if (ok && !id) this.known = true;  // the answer to `auth` has no number
    this.answer(ok, [what, text || (ok ? "done" : "refused")].filter(Boolean).join(": "));
    if (url && new URL(url).protocol.startsWith("http")) $("answer").append(" ", el("a", { href: url, target: "_blank", rel: "noopener" }, "open its page"));
    this.show();
  }

  answer(ok, text) {
    $("answer").textContent = text;
    $("answer").className = ok ? "" : "error";
    this.app.log(text, ok ? "" : "error");
  }

  lost() { this.waiting.clear(); Object.assign(this, { known: false, key: "" }); }

  /** Buttons for what can be done now. */
  show() {
    const { state: s, hello, steers } = this.app;
    $("stop").classList.toggle("pulled", Boolean(s.stop));
    $("stop").firstChild.textContent = s.stop ? "STOPPED " : "STOP ";
    const who = s.operator?.name;
    $("holder").textContent = s.operator?.you ? `You hold control as ${who}.${hello.real ? " Keep this tab in front: half a second without it stops the robot." : ""}` : who ? `${who} holds control.` : hello.mode === "live" ? "Nobody holds control." : "";
    $("auth").hidden = this.known || Boolean(s.operator?.you) || !hello.commands;
    const key = JSON.stringify([steers, hello.real, hello.mode, s.paused, s.level, s.waiting, s.stop, s.operator, s.ended, this.known, this.app.charts[0]?.message?.form, this.app.charts[0]?.message?.name]);
    if (key === this.key) return;
    this.key = key;
    $("commands").replaceChildren(...[this.consent(s, steers), this.control(s), ...(steers ? this.tools(s, hello) : []), hello.mode === "charts" && this.known ? this.start() : null].filter(Boolean));
  }

  button(text, what, more) { return el("button", { type: "button", onclick: () => this.command(what, more) }, text); }

  consent(s, steers) {
    const all = Object.entries(s.waiting ?? {});
    if (!all.length) return null;
    return el("ul", { className: "waiting", role: "alert" }, ...all.map(([path, outcome]) => el("li", {}, `${path}: ${outcome} waits for consent `,
      steers ? this.button("consent", "consent", { path, outcome }) : null, steers ? this.button("refuse", "refuse", { path, outcome }) : null)));
  }

  control(s) {
    if (s.operator?.you) return el("p", { className: "row" }, this.button("give control back", "release"));
    if (!this.known || !this.app.live) return null;
    return el("p", { className: "row" }, s.operator?.name ? sure(`take over from ${s.operator.name}`, () => this.command("take")) : this.button("take control", "take"));
  }

  tools(s, hello) {
    const level = el("select", { "aria-label": "level of autonomy", onchange: () => this.command("level", { level: level.value || null }) },
      ...["", "off", "low", "high", "full"].map((l) => el("option", { value: l, selected: l === (s.level ?? "") }, l || "only locks ask")));
    const reset = hello.real ? el("small", {}, "reset: at the console") : sure("reset", () => this.command("reset"));
    return [
      el("p", { className: "row" }, s.paused ? this.button("resume", "resume") : this.button("pause", "pause"), this.button("step", "step"), this.button("acknowledge", "ack"), reset),
      el("p", { className: "row" }, sure("preempt", () => this.command("preempt")), sure("end", () => this.command("end")), el("label", {}, "autonomy ", level)),
      this.replace(),
    ];
  }

  /** A form for another chart: fields for what the shown one declares, lines `key: value` for another. */
  start() {
    const { hello, charts } = this.app, shown = charts[0]?.message;
    const field = (label, input) => el("label", {}, `${label} `, input);
    const list = (id, names) => el("datalist", { id }, ...(names ?? []).map((n) => el("option", { value: n })));
    const chart = el("input", { value: shown?.name ?? "", list: "second-names" }), scene = el("input", { list: "scenes" }), user = el("input", { list: "users" });
    const fields = (shown?.form ?? []).map((f) => [f, el("input", { placeholder: f.default ?? f.what ?? f.type, title: f.about ?? "", required: f.default === null })]);
    const lines = { parameter: el("textarea", { rows: 2, placeholder: "name: value" }), input: el("textarea", { rows: 2, placeholder: "name: value" }) };
    const declared = el("div", { className: "form" }, ...fields.map(([f, input]) => field(`${f.name}${f.unit ? `, ${f.unit}` : ""}`, input)));
    const free = el("div", { className: "form", hidden: Boolean(shown?.form) }, field("parameters", lines.parameter), field("inputs", lines.input));
    chart.oninput = () => { declared.hidden = chart.value !== shown?.name; free.hidden = !declared.hidden; for (const [, i] of fields) i.disabled = declared.hidden; };
    const split = (text) => text.split("\n").map((l) => /^\s*([^:]+):\s*(.*)$/.exec(l)).filter(Boolean).map(([, k, v]) => [k.trim(), v]);
    const of = (kind) => Object.fromEntries(free.hidden ? fields.filter(([f, i]) => f.kind === kind && i.value).map(([f, i]) => [f.name, i.value]) : split(lines[kind].value));
    const form = el("form", { className: "form", onsubmit: (e) => e.preventDefault() }, field("chart", chart), field("scene", scene), field("user", user), list("scenes", hello.scenes), list("users", hello.users), declared, free);
    const go = sure("start", () => this.command("start", { chart: chart.value, parameters: of("parameter"), inputs: of("input"), scene: scene.value, user: user.value })), act = go.onclick;
    go.onclick = () => { if (form.reportValidity()) act(); };
    form.append(go);
    return el("details", {}, el("summary", {}, "start a chart"), form);
  }

  replace() {
    const text = el("textarea", { rows: 5, spellcheck: false, "aria-label": "YAML of the chart", placeholder: "chart: …" }), file = el("input", { type: "file", accept: ".yaml,.yml", "aria-label": "file of the chart" });
    file.onchange = async () => { text.value = await file.files[0].text(); };
    return el("details", {}, el("summary", {}, "change the running chart"), el("div", { className: "form" }, file, text, sure("replace", () => this.command("replace", { text: text.value }))));
  }
}

/** The last transitions, for the log. */
export const told = (entry) => `${seconds(entry.at)} ${entry.path ? `${entry.path}: ` : ""}${entry.text || entry.kind}`;
