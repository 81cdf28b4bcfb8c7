// JSON-RPC 2.0 over one WebSocket that reconnects by itself.

const FIRST_PAUSE_MS = 500;
const LONGEST_PAUSE_MS = 5000;

/** A call without an answer because the link broke. The service may have done it all the same. */
export class LinkLost extends Error {}

/**
 * Opens the link to `address`, relative to the page.
 * `opened()` and `lost()` tell each change; `notified(method, params)` gets the notifications.
 * Returns {call, retryNow}: call(method, params, patienceMs) promises the result. It throws LinkLost, or an Error with
 * the service's message.
 */
export function connect(address, { opened, lost, notified }) {
  const url = new URL(address, location.href);
  url.protocol = url.protocol.replace("http", "ws");
  const waiting = new Map();
  let socket;
  let number = 0;
  let pauseMs = FIRST_PAUSE_MS;
  let timer;

  function open() {
    clearTimeout(timer);
    const mine = (socket = new WebSocket(url));
    mine.onopen = () => {
      pauseMs = FIRST_PAUSE_MS;
      opened();
    };
    mine.onclose = () => mine === socket && close();
    mine.onmessage = ({ data }) => mine === socket && receive(data);
  }

  // A link that went silent may report its end minutes later, so its own report is not waited for.
  function close() {
    const old = socket;
    socket = undefined;
    old?.close();
    for (const { reject } of waiting.values()) reject(new LinkLost());
    waiting.clear();
    timer = setTimeout(open, pauseMs);
    pauseMs = Math.min(2 * pauseMs, LONGEST_PAUSE_MS);
    lost();
  }

  function receive(data) {
    let message;
    try {
      message = JSON.parse(data);
    } catch {
      return;
    }
    if (message?.method) return notified(message.method, message.params ?? {});
    const call = waiting.get(message?.id);
    if (!call) return;
    waiting.delete(message.id);
    if (message.error) call.reject(new Error(String(message.error.message ?? "")));
    else call.resolve(message.result);
  }

  function call(method, params = {}, patienceMs = 15000) {
    if (socket?.readyState !== WebSocket.OPEN) return Promise.reject(new LinkLost());
    const id = ++number;
    const mine = socket;
    return new Promise((resolve, reject) => {
      const patience = setTimeout(() => mine === socket && close(), patienceMs);
      const settled = (settle) => (value) => {
        clearTimeout(patience);
        settle(value);
      };
      waiting.set(id, { resolve: settled(resolve), reject: settled(reject) });
      mine.send(JSON.stringify({ jsonrpc: "2.0", id, method, params }));
    });
  }

  function retryNow() {
    if (!socket) open();
  }

  open();
  return { call, retryNow };
}
