// SPDX-License-Identifier: Apache-2.0
// Dialogs of the page: token, confirmation of commands, acknowledgement of alarms.
import {element, terms} from "./dom.js";
import {plain, forPeople} from "./words.js";
import {forgetToken, tokenInfo, tryToken} from "./server.js";

const dialog = document.getElementById("dialog");
const title = document.getElementById("dialog-title");
const body = document.getElementById("dialog-body");
const wrong = document.getElementById("dialog-wrong");
const yes = document.getElementById("dialog-yes");
const no = document.getElementById("dialog-no");
// time without a key press in the fields of a command, in milliseconds, after which the dialog reads the present value
// from the encoder
const WRITING_MS = 300;

/** Asks the user. `agree` runs on consent and returns "" or an error text. Resolves to whether the user agreed. */
function ask(words, button, nodes, agree) {
  title.textContent = words;
  body.replaceChildren(...nodes);
  wrong.textContent = "";
  yes.textContent = button;
  yes.disabled = false;
  return new Promise((resolve) => {
    let agreed = false;
    no.onclick = () => dialog.close();
    dialog.querySelector("form").onsubmit = async (event) => {
      event.preventDefault();
      yes.disabled = true;
      wrong.textContent = "";
      const trouble = await agree();
      yes.disabled = false;
      wrong.textContent = trouble;
      if (trouble !== "") return;
      agreed = true;
      dialog.close();
    };
    dialog.addEventListener("close", () => {
      body.replaceChildren();
      resolve(agreed);
    }, {once: true});
    dialog.showModal();
  });
}

const tokenField = () => element("input", {type: "password", autocomplete: "off", id: "dialog-token"});
const tokenLabel = (input) => element("label", {class: "field"}, "Your token, from the server's token file. It is forgotten when this tab is closed.", input);

/** Dialog of the token button in the bar: enters or forgets the token of this tab. */
export async function askToken() {
  const {name} = await tokenInfo();
  if (name !== null) {
    if (await ask("Token", "Forget it", [element("p", {}, "Commands of this tab are named ", element("strong", {}, name), " in the history.")], async () => "")) forgetToken();
    return;
  }
  const input = tokenField();
  await ask("Token", "Use it", [tokenLabel(input)], () => tryToken(input.value.trim()));
}

/** Asks the user to acknowledge an alarm. Resolves to whether the user agreed. */
export async function askAcknowledge(name, alarm) {
  const {name: who} = await tokenInfo();
  const token = tokenField();
  const nodes = [element("p", {}, "The alarm stays raised until the encoder clears it. All pages and the history show who has acknowledged it."),
                 terms([["named", who ?? "the name of the token below"]]), ...(who === null ? [tokenLabel(token)] : [])];
  return ask(`Acknowledge ${plain(alarm)}: ${name}`, "Acknowledge", nodes, async () => (who === null ? tryToken(token.value.trim()) : ""));
}

/**
 * Asks the user for the arguments of a command. Resolves to the arguments; null if the user does not agree. `now` and
 * `then` return the value before and after the command.
 */
export async function askCommand(name, command, now, then) {
  const {name: who} = await tokenInfo();
  const fields = command.arguments.map((argument) => element("input", {
    value: argument.default ?? "", inputmode: "numeric", required: argument.default === null, pattern: "-?(0[xX][0-9a-fA-F]+|[0-9]+)"}));
  const labels = fields.map((input, i) => {
    const {name: word, meaning, minimum, maximum} = command.arguments[i];
    return element("label", {class: "field"}, `${plain(word)}: ${forPeople(meaning)} (${minimum} to ${maximum})`, input);
  });
  const values = () => fields.map((input) => input.value.trim());
  const before = element("span", {}, "is being read");
  const after = element("span");
  const showAfter = () => after.replaceChildren(then(values()));
  let asked = 0;
  const showBefore = async () => {
    const question = ++asked;
    let text;
    try {
      text = await now(values());
    } catch (error) {
      text = `not known: ${error.message}`;
    }
    if (question !== asked) return;  // the answer belongs to an earlier question, which a newer question has replaced
    before.replaceChildren(text);
    before.closest("dl > div")?.toggleAttribute("hidden", text === "");
  };
  let pause;
  for (const input of fields) {
    input.addEventListener("input", () => {
      showAfter();
      clearTimeout(pause);
      pause = setTimeout(showBefore, WRITING_MS);
    });
  }
  showAfter();
  const token = tokenField();
  const safe = element("input", {type: "checkbox", required: true, id: "dialog-safe"});
  const nodes = [element("p", {}, command.meaning.charAt(0).toUpperCase() + command.meaning.slice(1) + "."), ...labels];
  if (command.changes_encoder) {
    nodes.push(terms([["now", before], ["then", after], ["named in the history", who ?? "the name of the token below"]]));
  }
  if (command.changes_encoder) showBefore();
  if (who === null) nodes.push(tokenLabel(token));
  if (command.changes_encoder) nodes.push(element("label", {class: "check"}, safe, ` Nothing moves or starts when ${name} is changed.`));
  const agreed = await ask(`${command.title}: ${name}`, command.title, nodes, async () => (who === null ? tryToken(token.value.trim()) : ""));
  if (!agreed) return null;
  const written = values();
  while (written.length > 0 && written.at(-1) === "") written.pop();
  return written;
}
