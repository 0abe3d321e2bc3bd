// SPDX-License-Identifier: Apache-2.0
// Which view is shown, and what the stream of events tells it.
import {ask, setText} from "./dom.js";
import {One} from "./encoder.js";
import {Glance} from "./glance.js";
import {Events, setToken} from "./server.js";

const main = document.getElementById("main");
const connection = document.getElementById("connection");
const historyTrouble = document.getElementById("history-trouble");
const announcements = document.getElementById("announcements");

let view;
let events;

function lose(why) {
  connection.className = "lost";
  setText(connection, `The connection to the server is lost: ${why}. What is shown is not live.`);
  view.lose();
}

function take(event, data) {
  if (event === "state") {
    connection.className = "";
    setText(connection, `connected: ${data.encoders.filter((one) => one.state === "live").length} of ${data.encoders.length} live`);
    const trouble = data.history?.trouble ?? "";
    historyTrouble.hidden = trouble === "";
    setText(historyTrouble, trouble === "" ? "" : `The history is not being written: ${trouble}. Lost so far: ${data.history.lost} rows.`);
    view.show(data);
  }
  if (event === "happening") setText(announcements, `${data.encoder} ${data.kind}: ${data.text}`);
  view.take(event, data);
}

function route() {
  const match = /^#encoder=(.*)$/.exec(location.hash);
  events?.close();
  view?.close();
  view = match ? new One(main, decodeURIComponent(match[1])) : new Glance(main);
  document.title = match ? `${decodeURIComponent(match[1])} – absenc` : "absenc";
  events = new Events(view.trace, {onEvent: take, onLost: lose});
}

document.getElementById("token").addEventListener("click", async () => {
  const token = await ask("Token", "Of the server's token file; kept until this tab is closed.", "Use it", "token");
  if (token !== null) setToken(token);
});
addEventListener("hashchange", () => {
  route();
  main.focus();
});
route();
