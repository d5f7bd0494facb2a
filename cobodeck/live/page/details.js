// What is known of one node: values, data, outcomes to force; its breakpoint and its lock.

import { $, button, el, fill, pairs, seconds, sure } from "./dom.js";
import { above } from "./picture.js";

export class Details {
  constructor(app) {
    Object.assign(this, { app, path: null, outcome: null, slot: 0, since: undefined });
    this.clock = el("span");
    this.boxes = [el("div"), el("ul", { className: "outcomes" }), el("p", { className: "row" })];
    $("details-body").append(...this.boxes);
  }

  pick(path, outcome, slot) {
    Object.assign(this, { path, outcome, slot });
    this.show();
  }

  /** Draws anew what has changed; a form in use stays while values change. */
  show() {
    const { app, path, slot } = this, { message } = app.charts[slot] ?? {};
    const node = message?.nodes?.[path];
    $("details-head").textContent = node ? `${path || message.name}${slot ? " (second)" : ""}` : "Details";
    $("details-hint").hidden = Boolean(node);
    this.since = node && app.states[slot]?.active?.[path];
    if (!node) {
      for (const box of this.boxes) fill(box, null, () => null);
      return;
    }
    const state = app.states[slot] ?? {}, [facts, ways, tools] = this.boxes;
    const active = this.since, values = bound(path, message.nodes, state.data ?? {});
    const locked = Boolean(state.locks?.includes(path));
    const stops = app.charts[slot].breaks.includes(path), steers = app.steers && !slot;
    const findings = (message.findings ?? []).filter((f) => f.path === path);
    fill(facts, [path, node, values, state.data?.[path], findings, active, locked, stops], () => [
      el("p", {}, [
        node.target ? `${node.kind} ${node.target}` : node.kind, locked && "locked", stops && "breakpoint",
      ].filter(Boolean).join(" · ")),
      active !== undefined && el("p", {}, `active since ${seconds(active)}, for `, this.clock),
      node.about && el("p", {}, node.about),
      node.file && el("code", {}, `${node.file}:${node.line}`),
      findings.map((f) => el("p", { className: f.severity }, `${f.code} ${f.message}`)),
      pairs(values),
      state.data?.[path] && [el("h3", {}, "Data"), pairs(state.data[path])],
      Object.keys(node.outcomes ?? {}).length > 0 && el("h3", {}, "Outcomes"),
    ]);
    this.timed();
    const forced = steers && active !== undefined;
    fill(ways, [path, node.outcomes, this.outcome, forced], () =>
      Object.entries(node.outcomes ?? {}).map(([outcome, outputs]) => this.way(outcome, outputs, forced)));
    const tool = (text, what) => button(text, () => app.command(what, { path }));
    fill(tools, [path, steers, locked, stops], () => steers && [
      stops ? tool("no breakpoint", "unbreak") : tool("breakpoint", "break"),
      locked ? tool("unlock", "unlock") : tool("lock", "lock"),
    ]);
  }

  /** What goes on with time alone. */
  timed() {
    if (this.since !== undefined) this.clock.textContent = seconds(Math.max(0, this.app.now() - this.since));
  }

  /** An outcome; where it can be forced, with a form that asks for its outputs by their types. */
  way(outcome, outputs, forced) {
    const told = Object.entries(outputs).map(([k, type]) => ` → ${k}: ${type}`).join("");
    const inputs = Object.entries(outputs).map(([k, type]) => [
      k, el("input", { placeholder: type, "aria-label": `${k}, ${type}`, required: true }),
    ]);
    const force = () => this.app.command("force", {
      path: this.path, outcome, outputs: Object.fromEntries(inputs.map(([k, input]) => [k, input.value])),
    });
    const form = el("form", { className: "row", onsubmit: (e) => e.preventDefault() },
      inputs.map(([k, input]) => el("label", {}, `${k} `, input)),
      sure(`force ${outcome}`, force, () => form.reportValidity()));
    const box = forced && el("details", { open: outcome === this.outcome }, el("summary", {}, "force"), form);
    return el("li", {}, el("b", {}, outcome), told, box);
  }
}

/** What a node is given; of keys that it reads, with what they hold in the chart around it. */
function bound(path, nodes, data) {
  let around = above(path);
  while (around && nodes[around]?.kind !== "use") around = above(around);
  const held = (path && data[around]) || {};
  return Object.fromEntries(Object.entries(nodes[path].values ?? {}).map(([name, text]) => {
    const key = /^← (.+)$/.exec(text)?.[1];
    return [name, key in held ? `${text} = ${held[key]}` : text];
  }));
}
