// SPDX-License-Identifier: Apache-2.0
// Browser notifications of alarms and losses, if the user allows them.
import {setText} from "./dom.js";
import {eventKind, plain} from "./words.js";

const button = document.getElementById("notify");
const KINDS = ["alarm", "lost", "ended"];
// Browsers allow notifications only for pages of this computer or behind TLS.
const isPossible = "Notification" in window && isSecureContext;

const isWanted = () => isPossible && localStorage.getItem("notify") === "on" && Notification.permission === "granted";

function show() {
  button.hidden = !isPossible;
  if (!isPossible) return;
  const isDenied = Notification.permission === "denied";
  button.disabled = isDenied;
  button.setAttribute("aria-pressed", String(isWanted()));
  button.title = isDenied ? "This browser does not allow notifications of this page: change that in its settings." : "Notifications of alarms and of encoders that are lost";
  setText(button, "Notify");
}

async function toggle() {
  const on = !isWanted() && await Notification.requestPermission() === "granted";
  localStorage.setItem("notify", on ? "on" : "off");
  show();
}

function showNotification(title, body, tag, hash) {
  if (!isWanted()) return;
  const note = new Notification(title, {body, tag, icon: "icon.svg"});
  note.onclick = () => {
    focus();
    location.hash = hash;
    note.close();
  };
}

export function notify({kind, encoder, text}) {
  if (!KINDS.includes(kind)) return;
  const [name, ...rest] = kind === "alarm" ? text.split(": ") : [eventKind(kind)[1], text];
  showNotification(`${encoder}: ${plain(name)}`, rest.join(": "), `${encoder} ${kind} ${name}`, `#encoder=${encodeURIComponent(encoder)}`);
}

export const notifyLoss = (why) => showNotification("absenc: no connection to the server", why, "server", "#");

button.addEventListener("click", toggle);
show();
