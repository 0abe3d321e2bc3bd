// SPDX-License-Identifier: Apache-2.0
// Converts values and states of encoders to texts for people.

export const NOTHING = "—";
const MINUS = "−";
const THIN = " ";  // the narrow no-break space, which separates groups of digits

/** Formats a number with groups of three digits: "−1 204.55". */
export function numberText(value, decimals = 0) {
  const [whole, part] = Math.abs(value).toFixed(decimals).split(".");
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, THIN);
  const negative = value < 0 && Number(value.toFixed(decimals)) !== 0;
  return `${negative ? MINUS : ""}${grouped}${part === undefined ? "" : "." + part}`;
}

export function duration(seconds) {
  if (seconds < 1) return `${Math.round(seconds * 1000)} ms`;
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min`;
  if (seconds < 172800) return `${Math.floor(seconds / 3600)} h`;
  return `${Math.floor(seconds / 86400)} days`;
}

export const microseconds = (us) => (us >= 1e6 ? `${numberText(us / 1e6, 2)} s` : us >= 1e3 ? `${numberText(us / 1e3, 2)} ms` : `${numberText(us, 1)} µs`);

/** Returns the time of day, with the date if it is not today. */
export function clock(at_ms) {
  const at = new Date(at_ms);
  const time = at.toLocaleTimeString("en-GB");
  if (at.toDateString() === new Date().toDateString()) return time;
  return `${at.toLocaleDateString("en-GB", {day: "numeric", month: "short", year: "numeric"})}, ${time}`;
}

/** Converts names to words: "ch1_status" to "channel 1 status". */
export const plain = (name) => name.replace(/[_-]/g, " ").replace(/\bch(?=\d)/, "channel ");
/** Converts texts of the API for people: "degC" to "°C", "over_heat" to "over heat". */
export const forPeople = (text) => text.replace(/\bdegC\b/g, "°C").replace(/\b[a-z0-9]+(_[a-z0-9]+)+\b/g, plain);
/** Removes the unit from the name of a field: "temperature_c" to "temperature". */
export const fieldName = (field) => plain(field.replace(/_(c|mv|ma|v|us|ms|s|hz|khz|deg|mm|rpm)$/, ""));
/** Converts a value for people: "80 degC" to "80 °C"; null becomes `missing`. */
export const valueText = (value, missing = "INVALID") => (value === null ? missing : forPeople(value).replace(/ deg$/, "°").replace(/ us$/, " µs").replace(/ revolutions$/, " turns"));
export const sentence = (text) => {
  const whole = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.!?]$/.test(whole) ? whole : whole + ".";
};

/** Returns the large figure as {text, unit, width}; `width` does not depend on the value. */
export function figure(encoder) {
  const whole = encoder.length_mm === null ? 6 : numberText(encoder.length_mm).length;
  const width = encoder.linear ? whole + 5 : 7;
  if (encoder.angle_deg !== null) return {text: encoder.angle_deg.toFixed(3), unit: "°", width};
  if (encoder.position_mm !== null) return {text: numberText(encoder.position_mm, 4), unit: "mm", width};
  if (encoder.state !== "live") return {text: NOTHING, unit: "", width};
  return {text: encoder.singleturn_valid === null ? "unknown" : "INVALID", unit: "", width};
}

/** Returns "12.0 ± 0.3": digits as the uncertainty permits, and the uncertainty rounded up. */
export function measuredText(value, uncertainty) {
  const decimals = uncertainty > 0 ? Math.min(4, Math.max(0, -Math.floor(Math.log10(uncertainty)))) : 4;
  const scale = 10 ** decimals;
  const rounded = Math.round(value * scale) / scale;
  const most = Math.ceil((uncertainty + Math.abs(rounded - value)) * scale - 1e-6) / scale;
  return `${numberText(rounded, decimals)} ± ${numberText(most, decimals)}`;
}

export function lastText(last) {
  if (last.angle_deg !== null) return `${last.angle_deg.toFixed(3)}°`;
  return last.position_mm !== null ? `${numberText(last.position_mm, 4)} mm` : "";
}

/** Returns the texts below the large figure of an encoder. `isSmall`: whether they are for a small card. */
export function belowFigure(encoder, now, isSmall = false) {
  if (encoder.state !== "live") {
    if (encoder.last_reading === null) return ["no reading yet"];
    const last = lastText(encoder.last_reading);
    return [last ? `last ${last}` : "last reading", `${duration(Math.max(0, (now - encoder.last_reading.at_ms) / 1000))} ago`];
  }
  const parts = [];
  if (encoder.turns !== null) parts.push(`${numberText(encoder.turns)} ${Math.abs(encoder.turns) === 1 ? "turn" : "turns"}`);
  else if (encoder.has_turns) parts.push(encoder.multiturn_valid === false ? "turns INVALID" : "turns unknown");
  else if (!encoder.linear) parts.push("single-turn");
  if (isSmall) {
    if (encoder.speed !== null) parts.push(`${numberText(encoder.speed, 1)} ${encoder.speed_unit}`);
    return parts;
  }
  if (encoder.speed !== null) parts.push(`${measuredText(encoder.speed, encoder.speed_uncertainty)} ${encoder.speed_unit}`);
  if (encoder.has_joint) {
    if (encoder.joint_deg !== null) parts.push(`joint ${numberText(encoder.joint_deg, 3)}°`);
    else if (encoder.joint_mm !== null) parts.push(`joint ${numberText(encoder.joint_mm, 4)} mm`);
    else parts.push("joint unknown");
    if (encoder.joint_speed !== null) parts.push(`joint ${measuredText(encoder.joint_speed, encoder.joint_speed_uncertainty)} ${encoder.speed_unit}`);
  }
  if (encoder.has_motor) parts.push(encoder.electrical_deg === null ? "electrical unknown" : `electrical ${numberText(encoder.electrical_deg, 1)}°`);
  return parts;
}

const GONE = {lost: "lost", silent: "no reply", failing: "no reply", ended: "stopped", unknown: "not known"};
export const SHAPES = {bad: "▲", warn: "◆", good: "●", plain: "○"};

/** Groups of encoders in display order, faulty ones first. */
export const GROUPS = ["unknown", "lost", "alarm", "errors", "waiting", "live", "good"];
/** Returns {group, kind, word} for an encoder, and perhaps `isSeen`: all alarms are acknowledged. */
export function condition(encoder) {
  const age = encoder.state === "unknown" ? "" : ` ${duration(encoder.age_s)}`;
  if (encoder.state in GONE) return {group: encoder.state === "unknown" ? "unknown" : "lost", kind: "bad", word: GONE[encoder.state] + age};
  if (encoder.state === "opening") return {group: "waiting", kind: "warn", word: "port missing"};
  if (encoder.state === "examined") return {group: "waiting", kind: "warn", word: "examined"};
  const count = encoder.alarms?.length ?? 0;
  const isSeen = count > 0 && encoder.alarms.every((alarm) => alarm.acknowledged);
  if (count > 0) return {group: "alarm", kind: "bad", isSeen, word: `${count === 1 ? "alarm" : `${count} alarms`}${isSeen ? ", seen" : ""}`};
  if (encoder.singleturn_valid === false || encoder.multiturn_valid === false) return {group: "alarm", kind: "bad", word: "invalid"};
  if (encoder.alarms === null && encoder.status?.length) return {group: "alarm", kind: "bad", word: "warning"};
  if (encoder.errors_last_minute > 0) return {group: "errors", kind: "warn", word: "errors"};
  return encoder.alarms === null ? {group: "live", kind: "plain", word: "live"} : {group: "good", kind: "good", word: "good"};
}

/** Texts for the number of encoders in a group, shown in the bar of the page. */
export const GROUP_WORDS = {
  unknown: (count) => `${count} not known`, lost: (count) => `${count} lost`, alarm: (count) => (count === 1 ? "1 alarm" : `${count} with alarms`), errors: (count) => `${count} with errors`,
  waiting: (count) => `${count} waiting`, live: (count) => `${count} live`, good: (count) => `${count} good`,
};

/** Additions to the texts of GROUP_WORDS, on wide screens only. */
export const MORE_WORDS = {live: ", alarms not reported"};

/** Returns the faults of an encoder as lines [kind, bold text, text]. */
export function faultLines(encoder) {
  const list = [];
  for (const alarm of encoder.alarms ?? []) {
    const seen = alarm.acknowledged ? `Acknowledged by ${alarm.acknowledged.who}, ${clock(alarm.acknowledged.at_ms)}. ` : "";
    list.push(["bad", sentence(plain((alarm.channel ? alarm.channel + " " : "") + alarm.name)), `${seen}${sentence(alarm.meaning)}${alarm.action ? " " + sentence(alarm.action) : ""}`]);
  }
  if (encoder.state === "live") {
    if (encoder.singleturn_valid === false && encoder.alarms?.length !== undefined) list.push(["bad", "Position invalid.", "The encoder reports that its position is invalid."]);
    if (encoder.alarms === null && encoder.status?.length) list.push(["bad", `Status: ${encoder.status.map(plain).join(", ")}.`, ""]);
    if (encoder.alarms === null) list.push(["faint", "", "Alarms not reported."]);
  }
  if (encoder.message) list.push([encoder.state === "examined" ? "warn" : "bad", "", sentence(forPeople(encoder.message))]);
  return list;
}

/** Formats a field of a response; flags are a list of names, null is an invalid value. */
export function fieldText(value, missing = "INVALID") {
  if (value === null) return missing;
  return Array.isArray(value) ? value.map(plain).join(", ") || "none" : String(value);
}

/** Severity and text of kinds of events; other kinds are "plain". */
const EVENT_KINDS = {
  alarm: ["bad", "alarm raised"], alarm_over: ["good", "alarm over"], acknowledged: ["plain", "acknowledged"], lost: ["bad", "lost"],
  failing: ["warn", "replies fail"], back: ["good", "back"], restarted: ["warn", "position restarted"], ended: ["bad", "stopped"],
  examined: ["plain", "examined"], command: ["plain", "command"], change: ["plain", "change"],
};
export const eventKind = (kind) => EVENT_KINDS[kind] ?? ["plain", plain(kind)];
