// Of all texts that are shown as HTML: their contrast with what they stand on.
(() => {
  const context = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const known = new Map();
  const rgba = (colour) => { if (!known.has(colour)) known.set(colour, painted(colour)); return known.get(colour); };
  const painted = (colour) => { context.clearRect(0, 0, 1, 1); context.fillStyle = colour; context.fillRect(0, 0, 1, 1); const d = context.getImageData(0, 0, 1, 1).data; return [d[0], d[1], d[2], d[3] / 255]; };
  const over = (top, below) => top.slice(0, 3).map((v, i) => v * top[3] + below[i] * (1 - top[3]));
  const ground = (e) => { const own = rgba(getComputedStyle(e).backgroundColor); return own[3] === 1 ? own : over(own, e.parentElement ? ground(e.parentElement) : [255, 255, 255]); };
  const light = (c) => { const [r, g, b] = c.map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const found = [];
  for (const e of document.body.querySelectorAll(":not(svg, svg *)")) {
    const text = [...e.childNodes].filter((n) => n.nodeType === 3).map((n) => n.data.trim()).join("") || e.placeholder || "";
    if (!text || !e.getClientRects().length || /SCRIPT|OPTION/.test(e.tagName)) continue;
    const on = ground(e), ink = over(rgba(getComputedStyle(e, e.placeholder && !e.value ? "::placeholder" : null).color), on);
    const [a, b] = [light(ink), light(on)].sort((x, y) => y - x);
    found.push({ text: text.slice(0, 30), on: e.tagName, ratio: (a + 0.05) / (b + 0.05) });
  }
  return found;
})()
