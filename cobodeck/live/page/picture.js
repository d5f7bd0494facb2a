// The SVG of `render`, read: which shapes stand for which node. Ids are those of `engine/draw`: `a_s:PATH` is the
// shape of a node, `o:PATH:OUTCOMES` and `a_o:…` are pins, `t:PATH:OUTCOMES` edges. Start dots and edges have no
// path in their id, and are known by their titles.

const ID = /^(a_)?([sot]):(.*)$/s;

export function shape(tag, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

export const above = (path) => path.slice(0, Math.max(path.lastIndexOf("/"), 0));
export const nameOf = (path) => path.slice(path.lastIndexOf("/") + 1);
export const within = (path, box) => box === "" || path === box || path.startsWith(`${box}/`);
/** Of paths, those that have none of the others inside. */
export const deepest = (paths) => paths.filter((p) => p && !paths.some((q) => q !== p && within(q, p)));

export class Picture {
  /** The picture of a text; null if that cannot be read. */
  static read(text, slot) {
    const svg = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
    return svg.nodeName === "svg" && !svg.querySelector("parsererror") ? new Picture(text, svg, slot) : null;
  }

  constructor(text, svg, slot) {
    const boxes = new Map(), frames = new Map(), ways = new Map();
    Object.assign(this, { text, svg: document.adoptNode(svg), boxes, frames, ways, parts: [] });
    this.size = svg.getAttribute("viewBox").split(/\s+/).map(Number);
    svg.removeAttribute("width");
    svg.removeAttribute("height");
    for (const g of svg.querySelectorAll("g[id]")) this.index(g, slot);
    for (const a of svg.querySelectorAll("a")) {
      const about = a.getAttribute("xlink:title")?.trim();
      if (about && a.parentNode.dataset.path) a.parentNode.prepend(shape("title", {}, about));
    }
    for (const g of svg.querySelectorAll("g.cluster")) {
      frames.set(g.dataset.path, g);
      boxes.get(g.dataset.path)?.classList.add("frame");
    }
    this.over = svg.querySelector("g.graph").appendChild(shape("g", { class: "over" }));
  }

  /** Notes what a group stands for: `boxes` and `frames` by path, `ways` by path and outcome, `parts` by their box. */
  index(g, slot) {
    const [, inner, kind, rest] = ID.exec(g.id) ?? [], title = g.querySelector(":scope > title");
    if (kind === "s") {
      g.dataset.path = rest;
      if (inner) this.boxes.set(rest, g);
      else this.parts.push([above(rest), rest, g]);
    } else if (kind) {
      const cut = rest.lastIndexOf(":"), path = rest.slice(0, cut), outcomes = rest.slice(cut + 1).split("|");
      Object.assign(g.dataset, { path, outcome: outcomes[0] });
      for (const o of outcomes) this.ways.set(`${path}:${o}`, [...(this.ways.get(`${path}:${o}`) ?? []), g]);
      if (!inner) this.parts.push([kind === "t" ? above(path) : path, path, g]);
    } else if (title && /node|edge/.test(g.getAttribute("class"))) {
      const path = title.textContent.split(/->|:/)[0];
      this.parts.push([path, path, g]);
    }
    if (slot) g.id = `${slot}:${g.id}`;
    title?.remove();
  }

  /** Where the shape of a node is, in the units of the drawing. */
  bounds(path) { return this.boxes.get(path)?.querySelector("path, polygon")?.getBBox(); }

  /** Shows what is in none of these boxes; of those themselves, their frames. */
  hide(folded) {
    for (const [box, path, g] of this.parts) {
      let away = false;
      for (let p = box; p; p = above(p)) away ||= folded.has(p) && !(p === path && g.id.includes("o:"));
      g.classList.toggle("away", away);
    }
  }
}
