// SPDX-License-Identifier: Apache-2.0
// Panels for examination, settings and memory of an encoder.
import {element, setText, table, terms} from "./dom.js";
import {pathOf, request} from "./server.js";
import {fieldName, plain, sentence, valueText, forPeople} from "./words.js";

const inLine = () => (matchMedia("(max-width: 40rem)").matches ? 8 : 16);
const GONE = new Set(["opening", "lost", "ended"]);  // encoder states after which another encoder may be on the port
const THERE = new Set(["live", "examined"]);

const hex = (number, digits) => number.toString(16).toUpperCase().padStart(digits, "0");
const clock = () => new Date().toLocaleTimeString("en-GB");

/** Returns table rows of bytes, "00 5A", with their printable characters. */
function dumpLines(part) {
  const bytes = part.data.match(/../g).map((pair) => parseInt(pair, 16));
  const lines = [];
  const count = inLine();
  for (let i = 0; i < bytes.length; i += count) {
    const some = bytes.slice(i, i + count);
    const characters = some.map((byte) => byte > 0x20 && byte < 0x7f ? String.fromCharCode(byte) : ".").join("");
    lines.push([String(part.page), "0x" + hex(part.address + i, 2), element("code", {}, some.map((byte) => hex(byte, 2)).join(" ")),
                element("code", {}, characters)]);
  }
  return lines;
}

function failures(failed) {
  return Object.entries(failed ?? {}).map(([name, why]) => element("p", {class: "why"}, `${name}: ${why}`));
}

/** A panel with a button, a status line, and the response. */
class ReadPanel {
  constructor(title, text, ...before) {
    this.button = element("button", {type: "button", onclick: () => this.run()}, text);
    this.status = element("p", {class: "status", role: "status"});
    this.result = element("div");
    this.node = element("div", {"aria-label": title}, element("p", {class: "row"}, ...before, this.button), this.status, this.result);
  }

  async ask(doing, path, values, method) {
    if (this.button.disabled) return;
    this.button.disabled = true;
    this.clearedText = null;
    this.showStatus(doing);
    this.result.replaceChildren();
    try {
      const {status, body} = await request(path, values, method);
      if (status !== 200) this.showStatus(body.error);
      else if (this.clearedText !== null) this.showStatus(this.clearedText);
      else this.take(body);
    } catch (error) {
      this.showStatus(`no response arrived: ${error.message}`);
    } finally {
      this.button.disabled = false;
    }
  }

  showStatus(words, good = false) {
    this.statusText = words;
    this.status.classList.toggle("good", good);
    setText(this.status, words);
  }

  /** Removes the shown result, which may have become invalid. */
  clearResult(why) {
    this.clearedText = `the result is no longer shown: ${why}`;
    if (this.result.childElementCount === 0) return;
    this.result.replaceChildren();
    this.showStatus(this.clearedText);
  }

  show(state) {
    if (GONE.has(state)) this.clearResult(`the encoder is ${state}`);
    const old = !THERE.has(state) && this.result.childElementCount !== 0;
    this.result.classList.toggle("stale", old);
    if (this.statusText) setText(this.status, old ? `${this.statusText}. The encoder does not reply now: this is the old result` : this.statusText);
  }
}

class Doctor extends ReadPanel {
  constructor(name) {
    super("Doctor", "Examine", element("span", {}, "Finds faults of the encoder or its line. It interrupts the readings for some seconds and writes nothing to the encoder. "));
    this.run = () => this.ask("the examination begins", pathOf(name, "doctor"), {}, "POST");
  }

  progress(encoder) {
    if (this.button.disabled && encoder.state === "examined") this.showStatus(encoder.message);
  }

  take(found) {
    this.showStatus(`At ${clock()}: ${found.verdict}`, found.ok);
    this.result.replaceChildren(...found.findings.map((finding) => element("div", {class: `finding ${finding.severity}`},
      element("h4", {}, `${plain(finding.severity)}: ${plain(finding.id)}`),
      terms([["seen", sentence(finding.evidence)], ["likely", sentence(finding.cause)], ["try", sentence(finding.action)]]))));
  }
}

class Settings extends ReadPanel {
  constructor(name) {
    super("Settings", "Read the settings", "The identity of the encoder and its settings. ");
    this.run = () => this.ask("the settings are being read", pathOf(name, "settings"), {});
  }

  take(found) {
    this.showStatus(`read at ${clock()}`);
    const names = [...new Set(found.rows.map((row) => row.setting))];
    this.result.replaceChildren(...names.flatMap((name) => {
      const own = found.rows.filter((row) => row.setting === name);
      return [element("h4", {}, plain(name)), element("p", {class: "faint"}, own[0].range === "" ? "" : `may be set to ${forPeople(own[0].range)}`),
              table(["field", "value", "meaning"], own, (row) => [fieldName(row.field), element("strong", {}, valueText(row.value)), forPeople(row.meaning)], name)];
    }), ...failures(found.failed));
  }
}

class Memory extends ReadPanel {
  constructor(name) {
    const part = element("select", {});
    super("Memory", "Read the memory", element("label", {}, "Part ", part), " ");
    this.part = part;
    this.run = () => this.ask("the memory is being read", pathOf(name, "memory"), part.value === "" ? {} : {page: part.value});
  }

  describe(areas, registers) {
    const pages = new Map();
    for (const area of areas) {
      for (let page = area.page; page < area.page + area.pages; page += 1) {
        pages.set(page, [...new Set([...(pages.get(page) ?? []), area.meaning])]);
      }
    }
    const all = areas.filter((area) => area.in_dump).reduce((sum, area) => sum + area.count, 0);
    this.part.replaceChildren(element("option", {value: ""}, registers > 0 ? `${registers} registers` : `all of a dump: ${all} bytes`),
                              ...[...pages].map(([page, meanings]) => element("option", {value: page}, `page ${page}: ${meanings.join(", ")}`)));
  }

  take(found) {
    const registers = found.registers;
    this.showStatus(`${registers ? `${registers.length} registers` : `${found.bytes} bytes`} read at ${clock()}`);
    const body = registers
      ? table(["register", "address", "value"], registers, (register) => [register.name, "0x" + hex(register.address, 2), register.value], "registers")
      : table(["page", "address", "bytes", "characters"], found.memory.flatMap(dumpLines), (line) => line, "memory");
    body.classList.add("dump");
    this.result.replaceChildren(body, ...failures(found.failed));
  }
}

export class Examine {
  constructor(name) {
    this.doctor = new Doctor(name);
    this.settings = new Settings(name);
    this.memory = new Memory(name);
    this.has = {settings: false, memory: false};  // whether the encoder has readable settings and memory; set by `describe`
  }

  /** Sets whether the encoder has readable settings and memory; later calls do nothing. */
  describe(readable) {
    if (this.described) return;
    this.described = true;
    this.has = {settings: readable.settings.length > 0, memory: readable.memory.length > 0 || readable.registers > 0};
    this.memory.describe(readable.memory, readable.registers);
  }

  show(encoder) {
    this.doctor.progress(encoder);
    for (const panel of [this.settings, this.memory]) panel.show(encoder.state);
  }

  lose(why) {
    for (const panel of [this.settings, this.memory]) panel.clearResult(why);
  }
}
