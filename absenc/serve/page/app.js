// SPDX-License-Identifier: Apache-2.0
// Main script of the page: selects the view, overview or one encoder, from the address.
import {askToken} from "./dialog.js";
import {setText} from "./dom.js";
import {EncoderPage} from "./encoder.js";
import {notify, notifyLoss} from "./notify.js";
import {Overview} from "./overview.js";
import {Events, tokenInfo} from "./server.js";
import {clock, sentence} from "./words.js";

const main = document.getElementById("main");
const bar = document.getElementById("bar");
const time = document.getElementById("clock");
const connection = document.getElementById("connection");
const historyTrouble = document.getElementById("history-trouble");
const announcements = document.getElementById("announcements");
const tokenButton = document.getElementById("token");

let view;
let events;
let shown;  // name of the encoder that is shown; null: all encoders

/** Shows that no events arrive. `refused`: whether the server refused the stream. */
function lose(why, refused = false) {
  if (connection.hidden && !refused) notifyLoss(why);
  connection.hidden = false;
  setText(connection, refused ? sentence(why) : `No connection to the server: ${why}. Nothing on this page is live.`);
  setText(time, "not live");
  view.lose(refused ? why : undefined);
}

// Shows why the server does not answer, and the token button, because the server may require a token for reading.
function explain(why, refused) {
  lose(why, refused);
  tokenButton.hidden = false;
}

function take(event, data) {
  if (event === "state") {
    if (!connection.hidden && view.isServed !== false) greet();
    connection.hidden = true;
    setText(time, clock(data.at_ms).split(", ").at(-1));
    const trouble = data.history?.trouble ?? "";
    historyTrouble.hidden = trouble === "";
    setText(historyTrouble, trouble === "" ? "" : `The history is not being written: ${trouble}. Rows lost so far: ${data.history.lost}.`);
    view.show(data);
    // the server has read absenc.toml again, and the shown encoder is no longer in the file
    if (view.isServed === false) {
      connection.hidden = false;
      setText(connection, `${shown} is no longer served: it was removed from absenc.toml. Nothing on this page is live.`);
    }
  }
  if (event === "happening") {
    setText(announcements, `${data.encoder} ${data.kind}: ${data.text}`);
    notify(data);
  }
  view.take(event, data);
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** Returns the values in the fragment of the page's address: encoder, tab, range, unit. */
function place() {
  const values = new URLSearchParams();
  for (const part of location.hash.slice(1).split("&")) {
    const [name, ...rest] = part.split("=");
    if (name !== "") values.set(name, decoded(rest.join("=")));
  }
  return values;
}

function route() {
  const values = place();
  const encoder = values.get("encoder");
  if (view !== undefined && encoder !== null && encoder === shown) return view.go(values);
  events?.close();
  view?.close();
  shown = encoder;
  bar.replaceChildren();
  view = encoder === null ? new Overview(main, bar) : new EncoderPage(main, bar, encoder, values);
  document.title = encoder === null ? "absenc" : `${encoder} – absenc`;
  events = new Events(view.trace, {onEvent: take, onLost: explain});
}

async function greet() {
  try {
    tokenButton.hidden = !(await tokenInfo()).tokens;
  } catch {
    // an error is ignored here, because the event stream reports an unreachable server
  }
}

tokenButton.addEventListener("click", askToken);
addEventListener("hashchange", () => {
  const before = shown;
  route();
  if (before !== shown) main.focus();
});
route();
greet();
