// Lists and tables of the tools: charts of a folder, findings, figures, health.

import { button, el, seconds } from "./dom.js";

const counted = (n, what) => n > 0 && `${n} ${what}${n === 1 ? "" : "s"}`;

/** Charts of a folder, each with what was found in it; `show(name)` shows one, `beside(name)` next to the first. */
export function chartList(charts, show, beside) {
  return charts.map(({ name, file, errors, warnings }) => {
    const found = [counted(errors, "error"), counted(warnings, "warning")].filter(Boolean).join(", ");
    return el("li", {},
      button(name, () => show(name), { title: file }),
      el("small", { className: errors ? "error" : "warning" }, found),
      button("beside", () => beside(name), { "aria-label": `show ${name} beside` }));
  });
}

/** Findings with their places; a press shows the node, and copies the place. */
export function findingList(findings, goTo) {
  return findings.map(({ severity, code, message, hint, file, line, column, path, slot }) => {
    const place = [file, line, column].filter((v) => v !== null && v !== undefined).join(":");
    const show = () => {
      goTo(path, slot);
      navigator.clipboard?.writeText(place).catch(() => {});
    };
    const told = [el("b", {}, `${severity} ${code} `), message];
    return el("li", {}, button(told, show, { className: severity, title: "show it, and copy its place" }),
      el("code", {}, place), hint && el("small", {}, hint));
  });
}

const table = (rows) => el("table", {}, el("tbody", {}, rows.map(([name, ...values]) =>
  el("tr", {}, el("th", { scope: "row" }, name), values.map((v) => el("td", {}, String(v)))))));

/** Rows of one run, or of two beside each other. */
function beside(one, two) {
  const other = new Map(two);
  return table(two ? [["record", 1, 2], ...one.map(([k, v]) => [k, v, other.get(k) ?? ""])] : one);
}

/** Figures of one run, or of two. */
export function figureTable([one, two]) {
  if (!one) return [];
  const { range, final } = one, all = final ? "of the whole run" : "so far";
  return [el("p", {}, range ? `of ${range.map(seconds).join(" – ")}` : all), beside(one.rows, two?.rows)];
}

export const healthTable = ([one, two]) => (one ? beside(healthRows(one), two && healthRows(two)) : "");

function healthRows({ late, missed, tick_p99_ms: p99, pages, dropped, gates, children, ages }) {
  const some = (v, unit = "") => (v === null || v === undefined ? "–" : `${v}${unit}`);
  return [
    ["late ticks", some(late)], ["missed ticks", some(missed)], ["tick, 99 of 100", some(p99, " ms")],
    ["pages", some(pages)], ["dropped for pages", some(dropped)],
    ...Object.entries(gates ?? {}), ...(children ?? []).map((c) => [c.name, c.state]),
    ...Object.entries(ages ?? {}).map(([k, v]) => [`age of ${k}`, some(v?.toFixed(2), " s")]),
  ];
}
