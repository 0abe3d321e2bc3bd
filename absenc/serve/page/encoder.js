// SPDX-License-Identifier: Apache-2.0
// Page of one encoder: current position and plot, faults, commands, and tabs with details.
import {askAcknowledge, askCommand} from "./dialog.js";
import {breakable, choice, dial, element, histogram, rich, scale, setChildren, setText, table, terms} from "./dom.js";
import {Examine} from "./examine.js";
import {figureNode, showParts, showState, stateNode} from "./overview.js";
import {Trace, isMarked, markText, quantities} from "./plots.js";
import {download, pathOf, request, tokenInfo} from "./server.js";
import {SHAPES, belowFigure, clock, condition, duration, fieldName, fieldText, figure, forPeople, eventKind, lastText, microseconds, numberText, plain, sentence, valueText, faultLines} from "./words.js";

const LIVE_MS = 20000;      // length of the live plot in milliseconds: the server stores the points of this time
// greatest part of a lost encoder's live plot that shows the time without readings, as a share of LIVE_MS
const LOST_SHARE = .15;
const MOST_POINTS = 2500;
const REFRESH_MS = 1000;
const WRITTEN_MS = 1500;    // time in milliseconds after which a new event is in the history
const PAST_MS = 10000;
const MOST_EVENTS = 100;
const RANGES = {live: ["Live", 0], "10m": ["10 min", 600], "1h": ["1 h", 3600], "24h": ["24 h", 86400], "7d": ["7 days", 604800], all: ["All", 31 * 86400]};
const TABS = {history: "History", exchanges: "Exchanges", settings: "Settings", memory: "Memory", doctor: "Doctor"};
const AWAY = ["opening", "lost", "examined"];
const SHOWN_COMMANDS = 3;
const LEAST_MS = 12;      // minimum time between two points taken from the event stream, in milliseconds

const byteText = (byte) => (Number.isNaN(byte) ? "?" : `0x${byte.toString(16).toUpperCase().padStart(2, "0")} (${byte})`);

function limitText(us) {
  if (us >= 1e6) return `${us / 1e6} s`;
  return us >= 1e3 ? `${us / 1e3} ms` : `${us} µs`;
}

// Returns the rows of the latency table, from the first to the last bucket that is not empty.
function latencyRows(buckets) {
  const filled = buckets.map(({count}) => count !== 0);
  return buckets.slice(Math.max(0, filled.indexOf(true)), filled.lastIndexOf(true) + 1)
    .map(({at_most: limit, count}) => [limit === null ? "longer" : `to ${limitText(limit)}`, count]);
}

// Returns the text for an encoder whose replies have no latency.
const noLatency = (encoder) => (encoder.readings === 0 ? "no reply yet" : "sent without requests");

export class EncoderPage {
  constructor(main, bar, name, values) {
    this.name = name;
    this.trace = name;
    this.points = [];     // points of the live plot as [at_ms, position, speed, uncertainty of the speed]
    this.events = [];
    // number of times the encoder was lost: refresh() ignores the response to a request from before a loss
    this.loss = 0;
    this.hasHistory = true;
    this.values = new Map(values);
    this.build(main, bar);
    this.timer = setInterval(() => this.refresh(), REFRESH_MS);
    this.pastTimer = setInterval(() => this.loadPast(), PAST_MS);
    const frame = () => {
      if (this.closed) return;
      if (this.changed) this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  build(main, bar) {
    bar.replaceChildren(element("a", {href: "#", class: "back"}, "← All encoders"));
    this.dial = dial();
    this.scale = scale();
    this.figure = figureNode();
    this.state = stateNode();
    this.about = element("p", {class: "faint about"});
    this.below = element("p", {class: "below"});
    this.ranges = element("div");
    this.units = element("div");
    this.scale.node.hidden = true;  // the scale is shown only for a linear encoder, after its length is known
    this.plot = element("div", {class: "plot", hidden: true, role: "img", "aria-label": "trace"});
    this.noTrace = element("p", {class: "faint"});
    this.wrong = element("div");
    this.wrongBox = element("section", {class: "box side"}, element("h3", {}, "What is wrong"), this.wrong);
    this.commands = element("div", {class: "commands"});
    this.outcome = element("p", {class: "status", role: "status"});
    this.line = element("div");
    this.examine = new Examine(this.name);
    this.doctorButton = element("button", {type: "button", onclick: () => {
      this.set("tab", "doctor");
      this.examine.doctor.run();
    }}, "Examine (doctor)");
    this.past = element("p", {class: "faint", role: "status"});
    this.eventTable = element("div");
    this.latencies = element("div");
    this.errors = element("div");
    this.fields = element("div");
    this.bad = element("div");
    this.csv = element("button", {type: "button", onclick: () => this.save()}, "Save as CSV");
    const part = (title, node) => element("div", {}, element("h4", {}, title), node);
    this.panels = {
      history: element("div", {}, element("p", {class: "row"}, this.csv, this.past), this.eventTable),
      exchanges: element("div", {class: "figures"}, part("Replies by latency", this.latencies), part("Failed attempts", this.errors),
                         element("div", {class: "wide"}, element("h4", {}, "Last reply"), this.fields), element("div", {class: "wide"}, element("h4", {}, "Last bad exchanges"), this.bad)),
      settings: this.examine.settings.node, memory: this.examine.memory.node, doctor: this.examine.doctor.node,
    };
    this.tabs = {};
    const tabs = Object.entries(TABS).map(([key, text]) => {
      Object.entries({id: `panel-${key}`, role: "tabpanel", "aria-labelledby": `tab-${key}`, tabindex: 0}).forEach(([name, value]) => this.panels[key].setAttribute(name, value));
      this.tabs[key] = element("button", {type: "button", role: "tab", id: `tab-${key}`, "aria-controls": `panel-${key}`, onclick: () => this.set("tab", key)}, text);
      return this.tabs[key];
    });
    const list = element("div", {role: "tablist", class: "tablist", "aria-label": "more about the encoder", onkeydown: (event) => this.step(event)}, ...tabs);
    main.replaceChildren(element("div", {class: "one"},
      element("section", {class: "box now-box"},
        element("div", {class: "head"}, element("h2", {}, ...breakable(this.name)), this.state), this.about,
        element("div", {class: "now large"}, this.dial.node, element("div", {}, this.figure.node, this.below)),
        this.scale.node,
        element("div", {class: "choices"}, this.ranges, this.units), this.plot, this.noTrace),
      element("div", {class: "beside"}, this.wrongBox,
        element("section", {class: "box side"}, element("h3", {}, "What can be done"), this.commands, this.outcome),
        element("section", {class: "box side"}, element("h3", {}, "Line"), this.line)),
      element("section", {class: "box tabs"}, list, ...Object.values(this.panels))));
    this.showTab();
  }

  /** Moves between tabs with the left and right keys. */
  step(event) {
    const move = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (move === undefined) return;
    const keys = Object.keys(TABS).filter((key) => !this.tabs[key].hidden);
    const next = keys[(keys.indexOf(this.tab) + move + keys.length) % keys.length];
    this.set("tab", next);
    this.tabs[next].focus();
  }

  /** Stores a value in the fragment of the address, so that the view can be shared as a link. */
  set(name, value) {
    this.values.set(name, value);
    const values = [...this.values].map(([key, text]) => `${key}=${encodeURIComponent(text)}`).join("&");
    history.replaceState(null, "", `#${values}`);
    this.go(this.values);
  }

  go(values) {
    this.values = new Map(values);
    this.showTab();
    if (this.encoder !== undefined) this.showChoices();
    this.loadPast();
    this.changed = true;
  }

  get tab() {
    const key = this.values.get("tab");
    return key in TABS && !this.tabs[key].hidden ? key : "history";
  }

  showTab() {
    for (const key of Object.keys(TABS)) {
      this.panels[key].toggleAttribute("hidden", key !== this.tab);
      this.tabs[key].setAttribute("aria-selected", String(key === this.tab));
      this.tabs[key].tabIndex = key === this.tab ? 0 : -1;
    }
  }

  get range() {
    const key = this.values.get("range");
    return key in RANGES && this.hasHistory ? key : "live";
  }

  showChoices() {
    const all = quantities(this.encoder);
    const possible = Object.entries(all).filter(([, quantity]) => !quantity.past || this.range !== "live");
    const wanted = this.values.get("unit");
    const unit = possible.some(([key]) => key === wanted) ? wanted : possible[0][0];
    const key = JSON.stringify([this.range, unit, this.hasHistory, this.encoder.counts_in_all, this.encoder.has_turns]);
    if (key === this.shownChoices) return;
    this.shownChoices = key;
    const focused = document.activeElement?.dataset?.value;
    const ranges = Object.entries(RANGES).map(([value, [text]]) => [value, text]);
    this.ranges.replaceChildren(this.hasHistory ? choice("range", ranges, this.range, (value) => this.set("range", value)) : element("p", {class: "faint"}, "The latest readings. The server stores no history: see --history."));
    this.units.replaceChildren(choice("unit", possible.map(([value, quantity]) => [value, quantity.text]), unit, (value) => this.set("unit", value)));
    if (focused) this.node(`[data-value="${focused}"]`)?.focus();
    this.quantity = all[unit];
    this.graph?.close();
    this.graph = undefined;
    this.changed = true;
  }

  node(selector) {
    return document.querySelector(`.one ${selector}`);
  }

  async seed() {
    try {
      const {status, body} = await request(pathOf(this.name, "points"));
      if (status !== 200 || this.closed) return;
      const first = this.points[0]?.[0] ?? Infinity;
      this.points.unshift(...body.points.filter(([at]) => at < first));
      this.changed = true;
    } catch {
      // an error is ignored here, because the event stream reports an unreachable server
    }
  }

  show(state) {
    const encoder = state.encoders.find((other) => other.encoder === this.name);
    this.isServed = encoder !== undefined;
    if (!this.isServed) return this.lose("this encoder is no longer served", "not served");
    const first = this.encoder === undefined || !this.known;
    const changed = this.encoder?.state !== encoder.state;
    this.encoder = encoder;
    this.known = true;
    this.at_ms = state.at_ms;
    this.hasHistory = state.history !== null;
    this.condition = condition(encoder);
    showState(this.state, this.condition);
    const address = encoder.address === this.name ? "" : ` · ${encoder.address}`;
    if (this.about.dataset.shown !== address) {
      this.about.dataset.shown = address;
      this.about.replaceChildren(...breakable(encoder.protocol_name + address));
    }
    this.figure.show(encoder);
    this.dial.node.toggleAttribute("hidden", encoder.linear);
    this.dial.turn(encoder.angle_deg);
    const scaled = encoder.linear && encoder.length_mm !== null;
    this.scale.node.toggleAttribute("hidden", !scaled);
    if (scaled) this.scale.move(encoder.position_mm === null ? null : encoder.position_mm / encoder.length_mm, `${numberText(encoder.length_mm)} mm`);
    const counts = encoder.counts === null ? [] : [`${numberText(encoder.counts)} ${encoder.counts_in_all === null ? "counts" : `of ${numberText(encoder.counts_in_all)} counts`}`];
    showParts(this.below, [...belowFigure(encoder, state.at_ms), ...counts]);
    // Commands are disabled while the port is missing, lost, or used by an examination.
    for (const button of this.commands.querySelectorAll("[data-command]")) button.disabled = AWAY.includes(encoder.state);
    this.showWrong();
    this.showChoices();
    this.examine.show(encoder);
    if (first) {
      this.seed();
      this.refresh();
      this.loadPast();
    }
    if (changed || encoder.state !== "live") this.changed = true;
  }

  /** Acknowledges an alarm: the server stores the user; the alarm stays raised. */
  async acknowledge(alarm) {
    try {
      if (!await askAcknowledge(this.name, alarm)) return;
      const {status, body} = await request(pathOf(this.name, "acknowledge"), {alarm}, "POST");
      setText(this.outcome, status === 200 ? `${sentence(plain(alarm))} Acknowledged by ${body.who}.` : sentence(body.error));
      this.outcome.className = `status ${status === 200 ? "good" : "bad"}`;
    } catch (error) {
      setText(this.outcome, `The alarm was not acknowledged: ${error.message}`);
    }
  }

  showWrong() {
    const encoder = this.encoder;
    const list = faultLines(encoder).map(([kind, strong, text], i) => {
      const alarm = encoder.alarms?.[i];
      const since = alarm?.since_ms ? `Since ${clock(alarm.since_ms)}. ` : "";
      return [kind, strong, since + text, this.mayChange && alarm && !alarm.acknowledged ? alarm.name : null];
    });
    if (encoder.state !== "live" && encoder.state !== "examined" && encoder.last_reading !== null) {
      list.push(["bad", "No reading", `since ${clock(encoder.last_reading.at_ms)}${lastText(encoder.last_reading) && `: then it was at ${lastText(encoder.last_reading)}`}.`]);
    }
    if (encoder.errors_last_minute > 0) list.push(["warn", `${numberText(encoder.errors_last_minute)} ${encoder.errors_last_minute === 1 ? "error" : "errors"}`, "in the last minute: see Exchanges."]);
    if (list.length === 0) list.push(["good", "Nothing.", "All alarms are reported clear, no reply failed in the last minute."]);
    const text = JSON.stringify(list);
    if (text === this.shownWrong) return;
    this.shownWrong = text;
    this.wrongBox.className = `box side ${this.condition.kind}`;
    this.wrong.replaceChildren(...list.map(([kind, strong, words, alarm]) => element("div", {}, element("p", {class: kind}, element("strong", {}, strong), strong && words ? " " : "", ...rich(words)),
      ...(alarm ? [element("button", {type: "button", class: "acknowledge", "data-acknowledge": alarm, onclick: () => this.acknowledge(alarm)}, "Acknowledge…")] : []))));
  }

  lose(why = "no connection to the server", word = "not known") {
    this.loss += 1;
    this.known = false;
    if (this.encoder !== undefined) {
      const last = this.encoder.state === "live" ? {...this.encoder, at_ms: this.at_ms} : this.encoder.last_reading;
      this.encoder = {...this.encoder, state: "unknown", angle_deg: null, position_mm: null, counts: null, turns: null, speed: null, alarms: null,
                  status: null, errors_last_minute: null, message: why, last_reading: last};
      this.condition = condition(this.encoder);
      this.figure.show(this.encoder);
      this.dial.turn(null);
      this.scale.move(null, "");
      showParts(this.below, belowFigure(this.encoder, Date.now()));
      this.showWrong();
    } else {
      setText(this.noTrace, sentence(why));
    }
    showState(this.state, {kind: "bad", word});
    for (const node of [this.fields, this.latencies, this.errors, this.bad, this.line, this.commands]) node.replaceChildren();
    this.offered = undefined;
    this.examine.lose(why);
    this.changed = true;
  }

  take(event, data) {
    if (event === "happening" && data.encoder === this.name) {
      clearTimeout(this.soon);
      this.soon = setTimeout(() => this.loadPast(), WRITTEN_MS);
    }
    if (event !== "points" || data.encoder !== this.name) return;
    for (const point of data.points) {
      if (point[0] - (this.points.at(-1)?.[0] ?? 0) >= LEAST_MS) this.points.push(point);
    }
    while (this.points.length > MOST_POINTS) this.points.shift();
    // live points do not change a plot of the history, which loadPast() and refresh() redraw
    if (this.range === "live") this.changed = true;
  }

  /** Returns the plot's rows, from the points or the history, in the selected unit. */
  rows() {
    const {of} = this.quantity;
    const row = (at, ...values) => [at, ...values.map((value) => value ?? null)];
    if (this.range === "live") {
      const list = [];
      for (const [at, place, speed] of this.points) {
        if (list.length > 0 && at - list.at(-1)[0] > 2500) list.push([at - 1, null, null, null]);
        const value = of(place, speed);
        list.push(row(at, value, value, value));
      }
      return list;
    }
    const list = [];
    let before = null;
    const {rows = [], step_s: step = 1} = this.history ?? {};
    for (const [at, least, mean, greatest, slow, middle, fast, , errors] of rows) {
      const values = this.quantity.past ? [0, errors, errors] : [of(least, slow), of(mean, middle), of(greatest, fast)];
      if (values[1] === null || (!this.quantity.past && mean === null)) continue;
      if (before !== null && at - before > 2 * step) list.push([(before + step) * 1000, null, null, null]);
      list.push(row(at * 1000, ...values));
      before = at;
    }
    return list;
  }

  draw() {
    this.changed = false;
    if (this.quantity === undefined) return;
    const rows = this.rows();
    const newest = rows.at(-1)?.[0];
    const isLive = this.encoder.state === "live";
    const none = newest === undefined || rows.every((row) => row[2] === null);
    this.plot.toggleAttribute("hidden", none);
    if (none) {
      const never = this.encoder.last_reading === null && !isLive;
      return setText(this.noTrace, this.range !== "live" ? "The history has no data for this time." : never ? "There has been no reading since the server started." : "There is no data to plot yet.");
    }
    setText(this.noTrace, "");
    this.graph ??= new Trace(this.plot, this.quantity);
    const lostAt = isLive ? null : this.encoder.last_reading?.at_ms ?? newest;
    const from = this.range === "live" ? LIVE_MS : RANGES[this.range][1] * 1000;
    const now = this.at_ms;
    // The plot of a lost encoder ends after the loss, so that the loss is visible.
    const to = this.range !== "live" ? now : isLive ? newest : Math.min(now, newest + LOST_SHARE * LIVE_MS);
    const width = this.range === "all" ? Math.max(60000, to - rows[0][0]) : isLive || this.range !== "live" ? from : to - rows[0][0] + 1;
    const marks = this.range === "live" ? [] : this.events.filter(isMarked).reverse();
    this.graph.draw(rows.filter((row) => row[0] >= to - width - 1000), [to - width, to], {marks, lostAt});
    const words = marks.length === 0 ? "" : `; marked: ${[...new Set(marks.map(markText))].join(", ")}`;
    this.plot.setAttribute("aria-label", `${this.quantity.text}, ${RANGES[this.range][0]}${words}`);
  }

  async refresh() {
    const {loss} = this;
    if (!this.known) return;
    let answer;
    try {
      answer = await request(pathOf(this.name));
    } catch {
      return;  // an error is ignored here, because the event stream reports an unreachable server
    }
    if (this.closed || this.loss !== loss || answer.status !== 200) return;
    const encoder = answer.body;
    this.examine.describe(encoder.readable);
    for (const key of ["settings", "memory"]) this.tabs[key].hidden = !this.examine.has[key];
    this.showTab();
    this.showLine(encoder);
    this.offer(encoder);
    this.changed = true;
    const missing = encoder.singleturn_valid === false || encoder.multiturn_valid === false ? "INVALID" : "unknown";
    setChildren(this.fields, encoder.reply === null ? element("p", {class: "faint"}, "no recent reply") : table(["field", "value", "meaning"], encoder.reply,
      ({field, value, meaning}) => [fieldName(field), element("strong", {}, valueText(value, missing)), forPeople(meaning)], "last reply"));
    const errors = Object.entries(encoder.errors).sort(([, a], [, b]) => b - a).map(([name, count]) => [plain(name), count]);
    const latencies = latencyRows(encoder.latency_us.buckets);
    setChildren(this.latencies, latencies.length === 0 || encoder.readings === 0 ? element("p", {class: "faint"}, noLatency(encoder)) : histogram(["latency", "replies"], latencies, "replies by latency"));
    setChildren(this.errors, errors.length === 0 ? element("p", {class: "faint"}, "none") : histogram(["error", "attempts"], errors, "failed attempts by kind"));
    setChildren(this.bad, encoder.bad_exchanges.length === 0 ? element("p", {class: "faint"}, "none") : table(
      ["ago", "what", "sent", "received"], encoder.bad_exchanges,
      (bad) => [duration(bad.age_s), `${plain(bad.error)}: ${bad.meaning}`, element("code", {}, bad.sent), element("code", {}, bad.received || "nothing")],
      "last bad exchanges"));
  }

  showLine(encoder) {
    const latency = encoder.latency_us;
    const live = encoder.state === "live";
    setChildren(this.line, terms([
      ["readings", `${live ? numberText(encoder.rate_hz, encoder.rate_hz < 10 ? 1 : 0) : 0} /s`],
      ["reply after", encoder.readings === 0 || latency.max === 0 ? noLatency(encoder) : `${microseconds(latency.p50)}, at most ${microseconds(latency.max)}`],
      ["errors, last minute", numberText(encoder.errors_last_minute)],
      ["good readings", numberText(encoder.readings)],
      ["failed attempts", numberText(Object.values(encoder.errors).reduce((sum, count) => sum + count, 0))],
      ["requests repeated", numberText(encoder.repeated)],
      ["port lost", encoder.losses === 1 ? "once" : `${numberText(encoder.losses)} times`],
    ]));
  }

  /** Creates the command buttons. Commands that change the encoder come first. */
  async offer(encoder) {
    if (this.offered !== undefined) return;
    this.offered = encoder.commands;
    let info;
    try {
      info = await tokenInfo();
    } catch {
      this.offered = undefined;
      return;
    }
    this.mayChange = info.tokens;
    this.showWrong();
    if (!info.tokens) {
      this.commands.replaceChildren(this.doctorButton, element("p", {class: "faint"}, "Nothing can be changed here: the server has no tokens. To change encoders, start it with ",
        element("code", {}, "--token-file FILE"), ", a file of lines NAME TOKEN."));
      return;
    }
    const first = ["clear_alarms", "zero", "reset_multiturn", "config_set"];
    const rank = (command) => (first.indexOf(command.verb) + 1 || 9) + (command.changes_encoder ? 0 : 10);
    const sorted = [...encoder.commands].sort((a, b) => rank(a) - rank(b));
    const button = (command) => {
      const title = plain(command.name).replace(/^./, (letter) => letter.toUpperCase());
      return element("button", {type: "button", title: command.meaning, "data-command": command.name, onclick: () => this.run({...command, title})}, `${title}…`);
    };
    const changing = sorted.filter((command) => command.changes_encoder);
    const shown = changing.slice(0, SHOWN_COMMANDS);
    const rest = sorted.filter((command) => !shown.includes(command));
    this.commands.replaceChildren(...shown.map(button), this.doctorButton,
      ...(rest.length === 0 ? [] : [element("details", {}, element("summary", {}, "More commands"), ...rest.map(button))]),
      element("p", {class: "faint"}, "Each command shows the value that it changes, and asks first. The history names your token."));
  }

  alarmsText() {
    const alarms = (this.encoder.alarms ?? []).map((alarm) => plain(alarm.name)).join(", ");
    return alarms || (this.encoder.alarms === null ? "alarms not reported" : "no alarms");
  }

  /** Resolves to a text of the value that `command` would change; "" if the command changes none. */
  async now(command, values) {
    if (command.verb === "zero") {
      const {text, unit} = figure(this.encoder);
      return `${text}${unit === "mm" ? " mm" : unit}`;
    }
    if (command.verb === "reset_multiturn") return this.encoder.turns === null ? `turns unknown; ${this.alarmsText()}` : `${numberText(this.encoder.turns)} turns; ${this.alarmsText()}`;
    if (command.verb === "clear_alarms") return this.alarmsText();
    if (command.reads_back) {
      const {status, body} = await request(pathOf(this.name, "settings"), {setting: command.reads_back});
      return status === 200 ? body.rows.map((row) => `${fieldName(row.field)} ${valueText(row.value)}`).join(", ") : `not known: ${body.error}`;
    }
    if (command.verb === "config_set") return "the encoder does not report it";
    if (command.verb !== "memory_write") return "";
    const of = (role) => Number(values[command.arguments.findIndex((argument) => argument.role === role)] || NaN);
    const [address, page] = [of("address"), of("page")];
    if (Number.isNaN(address)) return "the byte at the address";
    const {status, body} = await request(pathOf(this.name, "memory"), {page: page || 0});
    if (status !== 200) return `not known: ${body.error}`;
    const run = (body.memory ?? []).find((part) => address >= part.address && address < part.address + part.data.length / 2);
    return run === undefined ? "not known" : byteText(parseInt(run.data.substr(2 * (address - run.address), 2), 16));
  }

  async run(command) {
    const then = (values) => {
      if (command.verb === "zero") return this.encoder.linear ? "0.0000 mm" : "0.000°";
      if (command.verb === "reset_multiturn") return "0 turns";
      if (command.verb === "clear_alarms") return "alarms whose cause is gone are cleared";
      if (command.verb === "memory_write") return byteText(Number(values[command.arguments.findIndex((argument) => argument.role === "value")] || NaN));
      const written = command.arguments.map((argument, i) => [argument, values[i]]).filter(([argument, value]) => value !== String(argument.default))
        .map(([argument, value]) => `${plain(argument.name)} ${value || "?"}`).join(", ");
      return (written && command.reads_back ? `${plain(command.reads_back)}: ${written}` : written) || command.meaning;
    };
    let values;
    try {
      values = await askCommand(this.name, command, (written) => this.now(command, written), then);
    } catch (error) {
      return setText(this.outcome, `${command.title} was not done: ${error.message}`);
    }
    if (values === null) return;
    setText(this.outcome, `${command.title} is running.`);
    this.outcome.className = "status";
    try {
      const {status, body} = await request(pathOf(this.name, "command"), {command: command.name, argument: values}, "POST");
      const fields = Object.entries(body.fields ?? {}).map(([name, value]) => `${plain(name)} ${fieldText(value)}`).join(", ");
      setText(this.outcome, sentence(body.error ?? (fields ? `${body.text}: ${fields}` : body.text)));
      this.outcome.className = `status ${status === 200 ? "good" : "bad"}`;
    } catch (error) {
      setText(this.outcome, `No response arrived; read whether it was done: ${error.message}`);
    }
  }

  span() {
    const to = Math.floor(Date.now() / 1000);
    return {from: to - (RANGES[this.range][1] || 3600), to};
  }

  async loadPast() {
    if (this.closed || this.loading || this.encoder === undefined) return;
    this.csv.hidden = !this.hasHistory;
    if (!this.hasHistory) return setText(this.past, "The server stores no history: start it without --history none.");
    this.loading = true;
    const {range} = this;
    try {
      const events = await request(pathOf(this.name, "events"), {...this.span(), rows: MOST_EVENTS});
      if (this.closed) return;
      if (events.status !== 200) return setText(this.past, sentence(events.body.error));
      setText(this.past, `Events of the last ${range === "live" ? "hour" : RANGES[range][0]}.`);
      this.events = events.body.events;
      this.showEvents();
      if (range !== "live") {
        const past = await request(pathOf(this.name, "history"), {...this.span(), rows: 1500});
        if (past.status === 200) this.history = past.body;
      }
      this.changed = true;
    } catch {
      // an error is ignored here, because the event stream reports an unreachable server
    } finally {
      this.loading = false;
    }
    if (!this.closed && range !== this.range) this.loadPast();
  }

  showEvents() {
    const text = JSON.stringify(this.events);
    if (text === this.shownEvents) return;
    this.shownEvents = text;
    this.eventTable.replaceChildren(this.events.length === 0 ? element("p", {class: "faint"}, "No events in this time.") : table(
      ["when", "what", "details", "who"], this.events, (event) => {
        const [kind, words] = eventKind(event.kind);
        return [element("span", {class: "nowrap"}, clock(event.at_ms)), element("span", {class: `nowrap ${kind}`}, `${SHAPES[kind]} ${words}`), element("span", {}, ...rich(event.text.replace(/^\w+(?=:)/, plain))), event.who];
      }, "events"));
  }

  async save() {
    try {
      await download(pathOf(this.name, "history.csv"), this.span(), `${this.name.replace(/[^\w-]/g, "_")}.csv`);
    } catch (error) {
      setText(this.past, error.message);
    }
  }

  close() {
    this.closed = true;
    clearInterval(this.timer);
    clearInterval(this.pastTimer);
    clearTimeout(this.soon);
    this.graph?.close();
  }
}
