// Light and dark: as the system has it, or as the button says; remembered by the browser if it may.

import { $ } from "./dom.js";

const THEMES = ["", "light", "dark"];

/** Chooses the theme of before; `changed()` is called for each other one, too. */
export function themed(changed) {
  const { style } = document.documentElement;
  const choose = (name) => {
    style.colorScheme = name;
    $("theme").title = $("theme").ariaLabel = `colours: ${name || "as the system"}`;
    try { localStorage.theme = name; } catch { /* storage is off: for this visit only */ }
    changed();
  };
  $("theme").onclick = () => choose(THEMES[(THEMES.indexOf(style.colorScheme) + 1) % THEMES.length]);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  let name = "";
  try { name = localStorage.theme ?? ""; } catch { /* likewise */ }
  choose(name);
}
