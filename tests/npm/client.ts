// SPDX-License-Identifier: Apache-2.0
// A client of `absenc serve` written from openapi.json alone, for a test: requests every route except /openapi.json and
// the stream of one encoder, and prints the results.
import createClient from "openapi-fetch";
import type {components, paths} from "./api.js";

declare const process: {argv: string[]};
const [baseUrl, encoder, token] = process.argv.slice(2) as [string, string, string];
const client = createClient<paths>({baseUrl, headers: {Authorization: `Bearer ${token}`}});
const of = {params: {path: {encoder}}} as const;

/** Returns the data of a response, or throws its error. */
function need<T>({data, error, response}: {data?: T, error?: unknown, response: Response}): T {
  if (data === undefined) throw new Error(`${response.url}: ${response.status} ${JSON.stringify(error)}`);
  return data;
}

const state = need(await client.GET("/api/encoders"));
const first: components["schemas"]["Encoder"] | undefined = state.encoders[0];
const one = need(await client.GET("/api/encoders/{encoder}", of));
const history = need(await client.GET("/api/encoders/{encoder}/history", {params: {path: {encoder}, query: {rows: 10}}}));
const events = need(await client.GET("/api/encoders/{encoder}/events", of));
const all = need(await client.GET("/api/events"));
const minute = need(await client.GET("/api/minute"));
const points = need(await client.GET("/api/encoders/{encoder}/points", of));
const settings = need(await client.GET("/api/encoders/{encoder}/settings", {params: {path: {encoder}, query: {setting: "overheat-threshold"}}}));
const memory = need(await client.GET("/api/encoders/{encoder}/memory", {params: {path: {encoder}, query: {page: 0}}}));
const health = need(await client.GET("/healthz"));
const who = need(await client.GET("/api/token"));
const mqtt = await client.GET("/api/mqtt");
const csv = need(await client.GET("/api/encoders/{encoder}/history.csv", {...of, parseAs: "text"}));
const metrics = need(await client.GET("/metrics", {parseAs: "text"}));
const acknowledged = need(await client.POST("/api/encoders/{encoder}/acknowledge", {params: {path: {encoder}, query: {alarm: "over_heat"}}}));
const command = need(await client.POST("/api/encoders/{encoder}/command", {params: {path: {encoder}, query: {command: "set-overheat-threshold", argument: ["80"]}}}));
const doctor = need(await client.POST("/api/encoders/{encoder}/doctor", of));
const stream = await client.GET("/api/stream", {parseAs: "stream"});
await stream.response.body?.cancel();
const unknown = await client.GET("/api/encoders/{encoder}", {params: {path: {encoder: `${encoder}x`}}});

console.log(JSON.stringify({
  state: first?.state, alarm: first?.alarms?.[0]?.name, readings: one.readings, commands: one.commands.map(({name}) => name),
  shown: one.reply?.map(({field}) => field), step_s: history.step_s, kinds: events.events.map(({kind}) => kind), all: all.events.length,
  minute: minute.encoders[0]?.encoder, points: points.points.length, setting: settings.rows.map(({field, value}) => [field, value]),
  bytes: memory.bytes, ok: health.ok, who: who.name, mqtt: mqtt.data, csv: csv.split("\n")[0], has_metrics: metrics.includes("absenc_up"),
  acknowledged: acknowledged.who, command: command.text, doctor: doctor.ok, stream: stream.response.status, unknown: unknown.response.status,
}));
