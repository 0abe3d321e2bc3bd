// SPDX-License-Identifier: Apache-2.0
// Plots of position, speed or errors of one encoder, from live points or the history.
/* global Dygraph */
import {eventKind, plain, clock} from "./words.js";

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
// Scales `pixels`, a size for a font of 16 pixels, to the font size of the page.
const scaled = (pixels) => pixels * parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;
const NONE = [NaN, NaN, NaN];

/** Returns the quantities that a plot can show, by name. `past`: only the history has the quantity. */
export function quantities(encoder) {
  if (encoder.linear) {
    return {
      mm: {text: "mm", unit: " mm", of: (place) => place, least: .1},
      "mm/s": {text: "mm/s", unit: " mm/s", of: (place, speed) => speed, least: 1},
      errors: {text: "errors", unit: "", past: true, least: 4},
    };
  }
  const turn = encoder.counts_in_all ?? 0;
  const within = (place) => place - 360 * Math.floor(place / 360);
  return {
    degrees: {text: "degrees", unit: "°", of: (place) => place, turn: 360, within, wraps: !encoder.has_turns, least: .1, narrow: true},
    ...(encoder.has_turns ? {turns: {text: "turns", unit: "", of: (place) => place / 360, least: .01}} : {}),
    ...(turn > 0 ? {counts: {text: "counts", unit: "", of: (place) => place / 360 * turn, turn, wraps: !encoder.has_turns, within: (value) => value - turn * Math.floor(value / turn), least: 10}} : {}),
    rpm: {text: "rpm", unit: " rpm", of: (place, speed) => speed, least: 1, narrow: false},
    errors: {text: "errors", unit: "", past: true, least: 4},
  };
}

// Returns a function that creates grid labels with enough decimals to distinguish neighbours.
function gridLines(quantity) {
  return (low, high, pixels, options, graph, values) => {
    if (quantity.turn === 360 && high - low > 300) {
      const lines = [];
      for (let at = 90 * Math.ceil(low / 90); at <= high; at += 90 * Math.max(1, Math.ceil((high - low) / 900))) lines.push({v: at, label: `${at}°`});
      return high - low < 400 ? lines : lines.filter((line) => line.v - low > .05 * (high - low));
    }
    // No label stands at the lower end of the value axis, where it would overlap the labels of the time axis.
    const lines = Dygraph.numericTicks(low, high, pixels, options, graph, values).filter((line) => line.v - low > .05 * (high - low));
    if (lines.length < 2) return lines;
    const decimals = Math.min(9, Math.max(0, Math.ceil(-Math.log10(Math.abs(lines[1].v - lines[0].v)) - 1e-9)));
    return lines.map((line) => ({...line, label: line.v.toFixed(decimals) + quantity.unit}));
  };
}

const MARKED = ["alarm", "lost", "ended", "restarted"];
export const isMarked = (event) => MARKED.includes(event.kind);
export const markText = (event) => (event.kind === "alarm" ? plain(event.text.split(":")[0]) : eventKind(event.kind)[1]);

function drawMarks(canvas, area, graph, marks) {
  // for each of three rows of event labels: the x coordinate behind its last label, where the next label may begin
  const free = [area.x, area.x, area.x];
  for (const event of marks) {
    const x = Math.round(graph.toDomXCoord(event.at_ms)) + .5;
    if (x < area.x || x > area.x + area.w) continue;
    const bad = eventKind(event.kind)[0] === "bad";
    canvas.fillStyle = canvas.strokeStyle = style(bad ? "--bad" : "--warn");
    canvas.setLineDash(event.kind === "alarm" ? [] : [4, 3]);
    canvas.beginPath();
    canvas.moveTo(x, area.y);
    canvas.lineTo(x, area.y + area.h);
    canvas.stroke();
    const words = markText(event);
    const width = canvas.measureText(words).width;
    const left = Math.min(x + 3, area.x + area.w - width);
    const line = free.findIndex((end) => end <= left);
    if (line < 0) continue;
    canvas.fillText(words, left, area.y + scaled(12 + 14 * line));
    free[line] = left + width + 6;
  }
}

export class Trace {
  constructor(node, quantity) {
    this.node = node;
    this.quantity = quantity;
    this.marks = [];
    this.lostAt = null;
    this.graph = new Dygraph(node, [[new Date(), NONE]], {
      labels: ["time", "value"], customBars: true, legend: "never", strokeWidth: 1.5, fillAlpha: .25, interactionModel: {},
      gridLineColor: style("--line"), axisLineColor: style("--line"), axisLabelColor: style("--faint"), colors: [style("--accent")],
      axisLabelFontSize: Math.round(scaled(12)), axes: {
        y: {ticker: gridLines(quantity), axisLabelWidth: scaled(quantity.narrow ? 60 : 84), pixelsPerLabel: scaled(30)}, x: {axisLabelWidth: scaled(64), pixelsPerLabel: scaled(90)}},
      underlayCallback: (canvas, area, graph) => this.drawUnder(canvas, area, graph),
    });
    this.observer = new ResizeObserver(() => this.graph.resize());
    this.observer.observe(node);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.recolor = () => this.graph.updateOptions({gridLineColor: style("--line"), axisLineColor: style("--line"), axisLabelColor: style("--faint"), colors: [style("--accent")]});
    this.dark.addEventListener("change", this.recolor);
  }

  drawUnder(canvas, area, graph) {
    canvas.save();
    canvas.font = `${scaled(12)}px system-ui, sans-serif`;
    if (this.lostAt !== null) {
      const x = Math.max(area.x, graph.toDomXCoord(this.lostAt));
      canvas.fillStyle = style("--bad-soft");
      canvas.fillRect(x, area.y, area.x + area.w - x, area.h);
      const words = `no reading since ${clock(this.lostAt)}`;
      canvas.fillStyle = style("--bad");
      const width = canvas.measureText(words).width;
      canvas.fillText(words, Math.max(area.x + 4, Math.min(x + 6, area.x + area.w - width - 4)), area.y + scaled(14));
    }
    drawMarks(canvas, area, graph, this.marks);
    canvas.restore();
  }

  /** Draws rows of [at_ms, least, mean, greatest]. `window`: [from, to] in ms. */
  draw(rows, window, {marks = [], lostAt = null} = {}) {
    this.marks = marks;
    this.lostAt = lostAt;
    const {within, turn, least} = this.quantity;
    const list = [];
    let low = Infinity;
    let high = -Infinity;
    let before = null;
    // Positions are drawn within one turn if the shaft turns less than half a turn within each row of the history, and
    // from each row to the next.
    const fits = within && rows.every((row, i) => row[2] === null ||
      (row[3] - row[1] < turn / 2 && (i === 0 || rows[i - 1][2] === null || this.quantity.wraps || Math.abs(row[2] - rows[i - 1][2]) < turn / 2)));
    for (const [at, ...values] of rows) {
      if (values[1] === null) {
        list.push([new Date(at), NONE]);
        before = null;
        continue;
      }
      const mean = fits ? within(values[1]) : values[1];
      const shown = values.map((value) => value - values[1] + mean);
      if (fits && before !== null && Math.abs(mean - before) > turn / 2) list.push([new Date(at - 1), NONE]);
      before = mean;
      low = Math.min(low, shown[0]);
      high = Math.max(high, shown[2]);
      list.push([new Date(at), shown]);
    }
    const range = Math.max(high - low, least);
    const whole = fits && high - low > turn / 2;
    const middle = (high + low) / 2;
    const valueRange = whole ? [-turn * .02, turn * 1.02] : [middle - .6 * range, middle + .6 * range];
    if (list.length === 0) return;
    this.graph.updateOptions({file: list, dateWindow: window, valueRange});
  }

  close() {
    this.dark.removeEventListener("change", this.recolor);
    this.observer.disconnect();
    this.graph.destroy();
  }
}
