// What is known of one node: values, data, outcomes to force; its breakpoint and its lock.

import { $, el, seconds, sure } from "./dom.js";

const pairs = (object) => el("dl", {}, ...Object.entries(object).flatMap(([k, v]) => [el("dt", {}, k), el("dd", {}, String(v))]));

export class Details {
  constructor(app) { Object.assign(this, { app, path: null, outcome: null, slot: 0, key: "" }); }

  pick(path, outcome, slot = 0) { Object.assign(this, { path, outcome, slot, key: "" }); this.show(); }

  /** Draws it anew if what it shows has changed; a form in use stays. */
  show() {
    const { app, path } = this, chart = app.charts[this.slot];
    if (path === null || !chart?.message) return;
    const node = chart.message.nodes?.[path] ?? {}, s = app.state;
    const known = { node, data: s.data?.[path], active: s.active?.[path], locked: s.locks?.includes(path), stops: s.breaks?.includes(path) ?? node.break, steer: app.steers };
    const key = JSON.stringify([path, this.outcome, known]);
    if (key === this.key) return;
    this.key = key;
    const findings = (chart.message.findings ?? []).filter((f) => f.path === path);
    $("details-head").textContent = path || chart.message.name;
    $("details-body").replaceChildren(...[
      el("p", {}, [[node.kind, node.target].filter(Boolean).join(" "), known.active !== undefined ? `active since ${seconds(known.active)}` : "", known.locked ? "locked" : "", known.stops ? "breakpoint" : ""].filter(Boolean).join(" · ")),
      node.about ? el("p", { className: "about" }, node.about) : null,
      node.file ? el("code", {}, `${node.file}:${node.line}`) : null,
      ...findings.map((f) => el("p", { className: f.severity }, `${f.code} ${f.message}`)),
      Object.keys(node.values ?? {}).length ? pairs(node.values) : null,
      known.data ? el("h3", {}, "Data") : null, known.data ? pairs(known.data) : null,
      Object.keys(node.outcomes ?? {}).length ? el("h3", {}, "Outcomes") : null,
      el("ul", { className: "outcomes" }, ...Object.entries(node.outcomes ?? {}).map(([o, outputs]) => this.way(path, o, outputs, known))),
      app.steers ? this.tools(path, known) : null,
    ].filter(Boolean));
  }

  tools(path, { locked, stops }) {
    const button = (text, act) => el("button", { type: "button", onclick: () => this.app.command(act, { path }) }, text);
    return el("p", { className: "row" }, stops ? button("no breakpoint", "unbreak") : button("breakpoint", "break"), locked ? button("unlock", "unlock") : button("lock", "lock"));
  }

  /** An outcome; where the page may steer, with a form that asks for its outputs by their types. */
  way(path, outcome, outputs, { active, steer }) {
    const li = el("li", {}, el("b", {}, outcome), Object.entries(outputs ?? {}).map(([k, t]) => ` → ${k}: ${t}`).join(""));
    if (!steer || active === undefined) return li;
    const inputs = Object.entries(outputs ?? {}).map(([k, type]) => [k, el("input", { placeholder: type, "aria-label": `${k}, ${type}`, required: true })]);
    const force = sure(`force ${outcome}`, () => this.app.command("force", { path, outcome, outputs: Object.fromEntries(inputs.map(([k, i]) => [k, i.value])) }));
    const form = el("form", { className: "row", onsubmit: (e) => e.preventDefault() }, ...inputs.map(([k, i]) => el("label", {}, `${k} `, i)), force);
    const act = force.onclick;
    force.onclick = () => { if (form.reportValidity()) act(); };
    const box = el("details", { open: outcome === this.outcome }, el("summary", {}, "force"), form);
    li.append(box);
    return li;
  }
}
