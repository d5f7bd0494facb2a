// The connection to the server: found again when it is lost, later each time, at most 5 s.

const FIRST_MS = 250, LAST_MS = 5000;

export class Link {
  /** `got(message)` for each message; `turned(up)` when the connection is there or lost. */
  constructor(got, turned) {
    Object.assign(this, { got, turned, wait: FIRST_MS, socket: null, timer: 0 });
    addEventListener("online", () => this.open());
    document.addEventListener("visibilitychange", () => document.hidden || this.open());
    this.open();
  }

  get up() { return this.socket?.readyState === WebSocket.OPEN; }

  open() {
    if (this.socket && this.socket.readyState <= WebSocket.OPEN) return;
    clearTimeout(this.timer);
    const socket = this.socket = new WebSocket("/ws");
    socket.onopen = () => { this.wait = FIRST_MS; this.turned(true); };
    socket.onmessage = (e) => this.got(JSON.parse(e.data));
    socket.onclose = (e) => {
      if (socket !== this.socket) return;
      this.turned(false, e.reason);
      this.timer = setTimeout(() => this.open(), this.wait * (0.75 + Math.random() / 2));
      this.wait = Math.min(this.wait * 1.6, LAST_MS);
    };
  }

  /** False if there is no connection: nothing is kept for later, a late command is a wrong one. */
  send(message) {
    if (!this.up) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}
