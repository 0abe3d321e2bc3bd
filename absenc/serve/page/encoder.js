// SPDX-License-Identifier: Apache-2.0
// Everything about one encoder: live trace, history, errors, commands.
/* global Dygraph */
import {NOTHING, ask, dial, duration, element, fieldText, histogram, positionText, setText, speedText, stateText, table, turnsText, wordsOf} from "./dom.js";
import {Examine} from "./examine.js";
import {download, hasToken, request, setToken} from "./server.js";

const SHOWN_MS = 20000;
const MOST_POINTS = 2000;
const REFRESH_MS = 1000;
const WRITTEN_MS = 1500;  // then what has happened stands in the history
const PAST_MS = 10000;
const MOST_EVENTS = 100;

const ink = () => getComputedStyle(document.body).color;

// Labels with as many decimals as tell one line of the grid from the next.
function gridLines(...range) {
  const lines = Dygraph.numericTicks(...range);
  if (lines.length < 2) return lines;
  const decimals = Math.min(9, Math.max(0, Math.ceil(-Math.log10(Math.abs(lines[1].v - lines[0].v)))));
  return lines.map((line) => ({...line, label: line.v.toFixed(decimals)}));
}

// One point that is none, until there is something.
function plot(node, title, options) {
  const nothing = options.customBars ? [NaN, NaN, NaN] : NaN;
  return new Dygraph(node, [[new Date(), nothing]], {
    title, labels: ["time", title], axisLabelColor: ink(), axisLabelWidth: 72, axisLineColor: ink(), gridLineColor: "rgba(128,128,128,.35)", titleHeight: 20,
    colors: ["#2f7fd0", "#d07a1f"], strokeWidth: 1.5, legend: "never", axes: {y: {ticker: gridLines, axisLabelWidth: 96}}, ...options,
  });
}

function limitText(us) {
  if (us >= 1e6) return `${us / 1e6} s`;
  return us >= 1e3 ? `${us / 1e3} ms` : `${us} µs`;
}

// From the first bucket with something in it to the last.
function latencyRows(buckets) {
  const filled = buckets.map(({count}) => count !== 0);
  return buckets.slice(Math.max(0, filled.indexOf(true)), filled.lastIndexOf(true) + 1)
    .map(({at_most: limit, count}) => [limit === null ? "longer" : `to ${limitText(limit)}`, count]);
}

// Where nothing was read there is a gap, up to now: a loss must not lie beyond the end of the plot.
function pastRows({rows, step_s: step}) {
  const list = [];
  const gap = (at) => list.push([new Date(at * 1000), [NaN, NaN, NaN]]);
  let before = null;
  for (const [at, least, mean, greatest] of rows.filter((row) => row[2] !== null)) {
    if (before !== null && at - before > 2 * step) gap(before + step);
    list.push([new Date(at * 1000), [least, mean, greatest]]);
    before = at;
  }
  if (before !== null) gap(Math.max(before + step, Date.now() / 1000));
  return list;
}

// What the plot of the past marks, with its word: an alarm has its name before its meaning.
const MARKED = ["alarm", "lost", "silent", "ended", "restarted"];
const markText = (event) => (event.kind === "alarm" ? event.text.split(":")[0] : event.kind);

// Words that would stand on others are left out: the table below the plot has them all.
function drawMarks(canvas, area, graph, marks) {
  const style = getComputedStyle(document.body);
  canvas.save();
  canvas.font = "12px system-ui, sans-serif";
  const free = [area.x, area.x, area.x];  // where each of three lines of words ends
  for (const {at_ms: at, kind, ...event} of marks) {
    const x = Math.round(graph.toDomXCoord(at)) + .5;
    if (x < area.x || x > area.x + area.w) continue;
    canvas.fillStyle = canvas.strokeStyle = style.getPropertyValue(kind === "alarm" ? "--bad" : "--warn");
    canvas.setLineDash(kind === "alarm" ? [] : [4, 3]);
    canvas.beginPath();
    canvas.moveTo(x, area.y);
    canvas.lineTo(x, area.y + area.h);
    canvas.stroke();
    const words = markText({kind, ...event});
    const width = canvas.measureText(words).width;
    const left = Math.min(x + 3, area.x + area.w - width);
    const line = free.findIndex((end) => end <= left);
    if (line < 0) continue;
    canvas.fillText(words, left, area.y + 12 + 14 * line);
    free[line] = left + width + 6;
  }
  canvas.restore();
}

export class One {
  constructor(main, name) {
    this.name = name;
    this.trace = name;
    this.points = [];
    this.marks = [];
    this.word = null;  // a new one each time that the server is there again
    this.build(main);
    this.timer = setInterval(() => this.refresh(), REFRESH_MS);
    this.loadHistory();
    this.pastTimer = setInterval(() => this.loadHistory(), PAST_MS);
    const frame = () => {
      if (this.closed) return;
      this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  build(main) {
    this.dial = dial();
    this.state = element("p", {class: "state"});
    this.facts = element("dl");
    this.words = element("div");
    this.placePlot = element("div", {class: "plot", role: "img", "aria-label": "position over the last 20 seconds"});
    this.speedPlot = element("div", {class: "plot", role: "img", "aria-label": "speed over the last 20 seconds"});
    this.fields = element("dl");
    this.latencies = element("div");
    this.errors = element("div");
    this.bad = element("div");
    this.command = element("select", {"aria-label": "command", onchange: () => this.showArguments()});
    this.arguments = element("div");
    this.outcome = element("p", {role: "status"});
    this.hours = element("select", {onchange: () => this.loadHistory()},
                         ...[1, 6, 24, 168].map((hours) => element("option", {value: hours}, `${hours} h`)));
    this.pastPlot = element("div", {class: "plot", role: "img", "aria-label": "least, mean and greatest position"});
    this.past = element("p", {class: "why", role: "status"});
    this.events = element("div");
    this.examine = new Examine(this.name);
    const box = (title, ...children) => element("section", {class: "box"}, element("h2", {}, title), ...children);
    main.replaceChildren(
      element("p", {}, element("a", {href: "#"}, "all encoders")),
      box(this.name, element("div", {class: "card"}, this.dial.svg, element("div", {}, this.state, this.facts)), this.words),
      box("Live", this.placePlot, this.speedPlot),
      box("Last reply", this.fields),
      box("Latencies and errors", element("div", {class: "figures"}, this.latencies, this.errors)),
      box("Last bad exchanges", this.bad),
      box("Commands", element("p", {}, this.command, " ", element("button", {type: "button", onclick: () => this.run()}, "Run")),
          this.arguments, this.outcome),
      ...this.examine.nodes,
      box("History", element("p", {}, element("label", {}, "the last ", this.hours), " ",
                             element("button", {type: "button", onclick: () => this.save()}, "CSV")),
          this.past, this.pastPlot, this.events));
    const zoom = {interactionModel: {}};
    this.placeGraph = plot(this.placePlot, "position", zoom);
    this.speedGraph = plot(this.speedPlot, "speed", zoom);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.recolor = () => {
      for (const graph of [this.placeGraph, this.speedGraph, this.pastGraph]) graph?.updateOptions({axisLabelColor: ink(), axisLineColor: ink()});
    };
    this.dark.addEventListener("change", this.recolor);
  }

  show(state) {
    const one = state.encoders.find((other) => other.encoder === this.name);
    if (one === undefined) return this.lose("it is no longer served");
    if (this.word === null) {
      this.word = {};
      this.refresh();
    }
    this.dial.svg.toggleAttribute("hidden", one.linear);
    this.dial.turn(one.angle_deg);
    this.state.className = `state ${one.state}`;
    setText(this.state, stateText(one));
    this.live = one.state === "live";
    for (const node of [this.placePlot, this.speedPlot]) node.classList.toggle("stale", !this.live);
    this.facts.replaceChildren(...[
      ["position", positionText(one)], ["turns", turnsText(one)],
      ["speed", speedText(one)], ["readings a second", this.live ? one.rate_hz.toFixed(1) : NOTHING],
      ["errors, last minute", String(one.errors_last_minute)], ["address", one.address],
    ].flatMap(([label, value]) => [element("dt", {}, label), element("dd", {}, value)]));
    this.words.replaceChildren(...wordsOf(one).map(([kind, text]) => element("p", {class: kind}, text)));
    this.examine.show(one);
  }

  lose(why = "no connection to the server") {
    this.live = false;
    this.word = null;
    this.dial.turn(null);
    this.state.className = "state unknown";
    setText(this.state, `not known: ${why}`);
    this.facts.replaceChildren();
    for (const node of [this.fields, this.latencies, this.errors, this.bad, this.words]) node.replaceChildren();
    for (const node of [this.placePlot, this.speedPlot]) node.classList.add("stale");
    this.examine.lose(why);
  }

  take(event, data) {
    if (event === "happening" && data.encoder === this.name) {
      clearTimeout(this.soon);
      this.soon = setTimeout(() => this.loadHistory(), WRITTEN_MS);
    }
    if (event !== "points" || data.encoder !== this.name) return;
    const points = data.points.length > 8 ? data.points.filter((_, i) => i % Math.ceil(data.points.length / 8) === 0) : data.points;
    const last = this.points.at(-1);
    // A gap is drawn as one.
    if (last !== undefined && points[0][0] - last[0] > 1000) this.points.push([last[0] + 1, null, null]);
    this.points.push(...points);
    this.changed = true;
  }

  draw() {
    if (!this.changed) return;
    this.changed = false;
    const newest = this.points.at(-1)[0];
    while (this.points.length > MOST_POINTS || this.points[0][0] < newest - SHOWN_MS) this.points.shift();
    const window = [newest - SHOWN_MS, newest];
    this.placeGraph.updateOptions({file: this.points.map(([at, place]) => [new Date(at), place]), dateWindow: window});
    this.speedGraph.updateOptions({file: this.points.map(([at, , speed]) => [new Date(at), speed]), dateWindow: window});
  }

  async refresh() {
    const word = this.word;
    if (word === null) return;
    let answer;
    try {
      answer = await request("api/encoder", {name: this.name});
    } catch {
      return;  // the stream tells that the server is away
    }
    if (this.closed || this.word !== word || answer.status !== 200) return;  // not what was before a loss
    const one = answer.body;
    const missing = one.singleturn_valid === false || one.multiturn_valid === false ? "INVALID" : "unknown";
    const fields = Object.entries(one.fields ?? {}).map(([name, value]) => [name, fieldText(value, missing)]);
    this.examine.describe(one.readable);
    const latency = one.latency_us;
    fields.push(["latency", `50 % ${latency.p50.toFixed(0)} µs, 99 % ${latency.p99.toFixed(0)} µs, longest ${latency.max.toFixed(0)} µs`]);
    fields.push(["readings", `${one.readings}; port lost ${one.losses} times; repeated ${one.repeated}`]);
    this.fields.replaceChildren(...fields.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
    const errors = Object.entries(one.errors).sort(([, a], [, b]) => b - a);
    this.latencies.replaceChildren(histogram(["latency", "replies"], latencyRows(latency.buckets), "replies by latency"));
    this.errors.replaceChildren(errors.length === 0 ? element("p", {}, "no errors") :
      histogram(["error", "attempts"], errors, "failed attempts by kind"));
    this.bad.replaceChildren(one.bad_exchanges.length === 0 ? element("p", {}, "no exchange has failed") : table(
      ["ago", "what", "sent", "received"],
      one.bad_exchanges, (bad) => [duration(bad.age_s), `${bad.error}: ${bad.meaning}`, element("code", {}, bad.sent), element("code", {}, bad.received || "nothing")],
      "last bad exchanges"));
    if (this.commands === undefined) {
      this.commands = one.commands;
      this.command.replaceChildren(...one.commands.map((command) => element("option", {value: command.name}, `${command.name}: ${command.meaning}`)));
      this.showArguments();
    }
  }

  chosen() {
    return this.commands?.find((command) => command.name === this.command.value);
  }

  showArguments() {
    this.arguments.replaceChildren(...(this.chosen()?.arguments ?? []).map((argument) => element("p", {}, element("label", {},
      `${argument.name} (${argument.meaning}; ${argument.minimum} to ${argument.maximum}) `,
      element("input", {value: argument.default ?? "", inputmode: "numeric"})))));
  }

  async run() {
    const command = this.chosen();
    if (command === undefined) return;
    if (command.changes_encoder) {
      if (!await ask(command.name, `This changes the encoder ${this.name}: ${command.meaning}. Go on?`, "Go on")) return;
      if (!await ask(command.name, `Once more: ${this.name} will be changed now and may not be as it was again. Is the machine safe?`, "Do it")) return;
    }
    if (!hasToken()) {
      const token = await ask("Token", "Commands need a token of the server's token file.", "Use it", "token");
      if (token === null) return;
      setToken(token);
    }
    const values = {encoder: this.name, command: command.name, argument: [...this.arguments.querySelectorAll("input")].map((input) => input.value).filter((text) => text !== "")};
    setText(this.outcome, `${command.name} is running`);
    try {
      const {status, body} = await request("api/command", values, "POST");
      if (status === 401) setToken("");
      const fields = Object.entries(body.fields ?? {}).map(([name, value]) => `${name} ${fieldText(value)}`).join(", ");
      setText(this.outcome, body.error ?? (fields ? `${body.text}: ${fields}` : body.text));
    } catch (error) {
      setText(this.outcome, `no answer came, read whether it was done: ${error.message}`);
    }
  }

  range() {
    const to = Math.floor(Date.now() / 1000);
    return {encoder: this.name, from: to - Number(this.hours.value) * 3600, to};
  }

  async loadHistory() {
    if (this.loading) return;
    this.loading = true;
    try {
      const past = await request("api/history", {...this.range(), rows: 1500});
      if (this.closed) return;
      setText(this.past, past.body.error ?? "");
      if (past.status !== 200) return;
      const list = pastRows(past.body);
      const events = (await request("api/events", {...this.range(), rows: MOST_EVENTS})).body.events;
      if (this.closed) return;
      this.marks = events.filter((event) => MARKED.includes(event.kind)).reverse();
      this.pastPlot.setAttribute("aria-label", `least, mean and greatest position; marked: ${[...new Set(this.marks.map(markText))].join(", ") || "nothing"}`);
      this.pastGraph ??= plot(this.pastPlot, "position: least, mean, greatest", {
        customBars: true, underlayCallback: (canvas, area, graph) => drawMarks(canvas, area, graph, this.marks)});
      this.pastGraph.updateOptions(list.length === 0 ? {} : {file: list});
      this.events.replaceChildren(events.length === 0 ? element("p", {}, "nothing has happened") : table(
        ["when", "what", "", "who"],
        events, (event) => [new Date(event.at_ms).toLocaleString(), event.kind, event.text, event.who], "events"));
    } catch {
      // the stream tells that the server is away
    } finally {
      this.loading = false;
    }
  }

  async save() {
    try {
      await download("api/history.csv", this.range(), `${this.name.replace(/[^\w-]/g, "_")}.csv`);
    } catch (error) {
      setText(this.past, error.message);
    }
  }

  close() {
    this.closed = true;
    clearInterval(this.timer);
    clearInterval(this.pastTimer);
    clearTimeout(this.soon);
    this.dark.removeEventListener("change", this.recolor);
    for (const graph of [this.placeGraph, this.speedGraph, this.pastGraph]) graph?.destroy();
  }
}
