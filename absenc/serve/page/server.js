// SPDX-License-Identifier: Apache-2.0
// Requests to the server, with the token, and the event stream of the server.

let token = sessionStorage.getItem("token") ?? "";

function setToken(text) {
  token = text;
  sessionStorage.setItem("token", text);
}
export const forgetToken = () => setToken("");

const headers = () => (token === "" ? {} : {Authorization: `Bearer ${token}`});

/** Returns the API path of an encoder, or of one of its parts. */
export const pathOf = (name, part = "") => `api/encoders/${encodeURIComponent(name)}${part && `/${part}`}`;

/** Sends a request to the server. Returns {status, body} with the HTTP status and the parsed JSON body. */
export async function request(path, values = {}, method = "GET") {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(values)) {
    for (const one of Array.isArray(value) ? value : [value]) query.append(name, one);
  }
  const answer = await fetch(`${path}?${query}`, {method, headers: headers(), cache: "no-store"});
  return {status: answer.status, body: await answer.json()};
}

/** Returns {tokens, name}: whether the server has tokens, and the name of this tab's token. */
export async function tokenInfo() {
  const {status, body} = await request("api/token");
  if (status === 200) return body;
  forgetToken();
  return {tokens: true, name: null};
}

/** Checks a token. Returns "" and stores it if it is valid, else returns the error. */
export async function tryToken(text) {
  if (text === "") return "Commands need a token.";
  const before = token;
  setToken(text);
  try {
    const {status, body} = await request("api/token");
    if (status === 200) return "";
    setToken(before);
    return body.error;
  } catch (error) {
    setToken(before);
    return `no response arrived: ${error.message}`;
  }
}

/** Saves a response as a file. A plain link could not send the token. */
export async function download(path, values, name) {
  const answer = await fetch(`${path}?${new URLSearchParams(values)}`, {headers: headers(), cache: "no-store"});
  if (!answer.ok) throw new Error((await answer.json()).error);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await answer.blob());
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const PATIENCE = 1500;
const PAUSE = 500;

/** The server's event stream. EventSource is not used, because it cannot send a token. */
export class Events {
  constructor(trace, {onEvent, onLost}) {
    this.trace = trace;
    this.onEvent = onEvent;
    this.onLost = onLost;
    this.open();
  }

  close() {
    this.closed = true;
    this.abort?.abort();
    clearTimeout(this.timer);
  }

  wait() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.onLost("no data from the server");
      this.abort.abort();
    }, PATIENCE);
  }

  async open() {
    while (!this.closed) {
      this.abort = new AbortController();
      this.wait();
      try {
        await this.read();
        if (!this.closed) this.onLost("the server closed the connection");
      } catch (error) {
        if (!this.closed && !this.abort.signal.aborted) this.onLost(error.message, error.refused);
      }
      clearTimeout(this.timer);
      await new Promise((resolve) => setTimeout(resolve, PAUSE));
    }
  }

  async read() {
    const path = this.trace === "" ? "api/stream" : pathOf(this.trace, "stream");
    const answer = await fetch(path, {headers: headers(), signal: this.abort.signal, cache: "no-store"});
    if (!answer.ok) throw Object.assign(new Error((await answer.json()).error), {refused: true});
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    for (let text = ""; ;) {
      const {value, done} = await reader.read();
      if (done) return;
      this.wait();
      text += value;
      for (let end; (end = text.indexOf("\n\n")) >= 0; text = text.slice(end + 2)) this.take(text.slice(0, end));
    }
  }

  take(message) {
    let name = "";
    let data = "";
    for (const line of message.split("\n")) {
      if (line.startsWith("event: ")) name = line.slice(7);
      if (line.startsWith("data: ")) data += line.slice(6);
    }
    if (name !== "" && !this.closed) this.onEvent(name, JSON.parse(data));
  }
}
