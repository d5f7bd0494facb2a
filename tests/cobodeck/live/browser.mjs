// A page in Chromium, driven line by line: {"do", …} in, {"ok", "value"} out. Ends with its input.
import { createRequire } from "node:module";
import { createInterface } from "node:readline";

const [, , place, executablePath] = process.argv;
const { chromium } = createRequire(`${place}/`)("playwright-core");
const PATIENCE = 60000;
const heard = { errors: [], urls: [] };
let browser, page, looks;

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

const jobs = {
  async open({ url, width, height, scheme }) {
    await page?.context().close();
    Object.assign(heard, { errors: [], urls: [] });
    const context = await browser.newContext({ viewport: { width, height }, colorScheme: scheme });
    page = await context.newPage();
    looks = { width, height, scheme };
    page.setDefaultTimeout(PATIENCE);
    page.on("console", (m) => { if (m.type() === "error" || m.type() === "warning") heard.errors.push(m.text()); });
    page.on("pageerror", (e) => heard.errors.push(String(e.stack ?? e)));
    page.on("request", (r) => heard.urls.push(r.url()));
    await page.goto(url);
  },
  heard: async () => heard,
  see: ({ js }) => page.evaluate(js),
  async until({ js }) {
    const end = Date.now() + PATIENCE;
    for (let ms = 10; Date.now() < end; ms = Math.min(1.5 * ms, 100)) { if (await page.evaluate(js)) return true; await wait(ms); }
    const seen = await page.evaluate("document.body.innerText");
    throw new Error(`in vain: ${js}; errors: ${heard.errors.join("; ")}; the page says:\n${seen}`);
  },
  click: ({ on }) => page.click(on),
  fill: ({ on, text }) => page.fill(on, text),
  focus: ({ on }) => page.focus(on),
  press: ({ key }) => page.keyboard.press(key),
  /** Whether another page gets a connection. */
  async foreign({ page: of, url }) {
    const other = await page.context().newPage();
    await other.goto(of);
    const opened = await other.evaluate((at) => new Promise((done) => {
      const socket = new WebSocket(at);
      socket.onopen = () => done(true);
      socket.onerror = () => done(false);
    }), url);
    await other.close();
    return opened;
  },
  async resize({ width, height }) {
    if (width === looks.width && height === looks.height) return; // else it is laid out anew
    Object.assign(looks, { width, height });
    await page.setViewportSize({ width, height });
  },
  async scheme({ scheme }) {
    if (scheme === looks.scheme) return;
    looks.scheme = scheme;
    await page.emulateMedia({ colorScheme: scheme });
  },
  async drag({ on, from, to }) {
    const box = await page.locator(on).boundingBox();
    const at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
    await page.mouse.move(...at(from));
    await page.mouse.down();
    await page.mouse.move(...at(to), { steps: 5 });
    await page.mouse.up();
  },
  shot: ({ file }) => page.screenshot({ path: file, timeout: PATIENCE }),
};

try {
  browser = await chromium.launch({ executablePath, timeout: 60000, args: ["--disable-dev-shm-usage", "--disable-gpu"] });
  console.log(JSON.stringify({ ok: true, value: "ready" }));
  for await (const line of createInterface({ input: process.stdin })) {
    const job = JSON.parse(line);
    try { console.log(JSON.stringify({ ok: true, value: (await jobs[job.do](job)) ?? null })); }
    catch (error) { console.log(JSON.stringify({ ok: false, value: String(error) })); }
  }
} finally { await browser?.close(); }
process.exit(0);
