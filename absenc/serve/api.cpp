// SPDX-License-Identifier: Apache-2.0
#include "absenc/serve/api.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <limits>

#include "absenc/client/error.hpp"
#include "absenc/client/text/nearest.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/protocol/options.hpp"
#include "absenc/serve/assets.hpp"
#include "absenc/serve/view.hpp"

namespace absenc::serve {

using namespace client;

namespace {

constexpr std::int64_t most_rows = 5000;  // greatest number of rows in one JSON response
// number of rows of a CSV response that are read from the history at a time
constexpr std::int64_t rows_of_a_page = 10'000;

/// An error that is answered with HTTP status 400.
struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An error that is answered with HTTP status 404.
struct NotFound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Response json_response(const Json& json) { return {200, "application/json", json.line() + "\n"}; }

const Asset* find_asset(std::string_view path) {
  for (const Asset& asset : assets()) {
    if (asset.path == path) return &asset;
  }
  return nullptr;
}

std::int64_t number_in(const Request& request, const std::string& name, std::int64_t fallback, std::int64_t least,
                       std::int64_t most) {
  const std::string text = request.value(name);
  if (text.empty()) return fallback;
  const Result<std::int64_t> number = parse_number(text);
  if (number && *number >= least && *number <= most) return *number;
  throw BadRequest(fmt::format("{} must be a whole number from {} to {}", name, least, most));
}

// Returns the requested range of time in calendar seconds; by default it ends now and begins an hour before its end.
Range range_in(const Request& request) {
  constexpr std::int64_t latest = 1'000'000'000'000;
  Range range;
  range.to_s = number_in(request, "to", calendar_ms() / 1000, 0, latest);
  range.from_s = number_in(request, "from", range.to_s - 3600, 0, latest);
  if (range.from_s > range.to_s) throw BadRequest("from must not be later than to");
  return range;
}

constexpr std::string_view encoders_path = "/api/encoders/";
constexpr std::array<std::string_view, 10> parts_of_encoder{"acknowledge", "command", "doctor", "events",   "history",
                                                            "history.csv", "memory",  "points", "settings", "stream"};

/// The parts of a path /api/encoders/NAME/PART. NAME may contain slashes; PART may be missing.
struct Target {
  std::string_view name;
  std::string_view part;
};

Target target_of(std::string_view path) {
  const std::string_view rest = path.substr(encoders_path.size());
  const std::size_t slash = rest.rfind('/');
  if (slash == std::string_view::npos) return {rest, {}};
  const std::string_view last = rest.substr(slash + 1);
  if (std::find(parts_of_encoder.begin(), parts_of_encoder.end(), last) == parts_of_encoder.end()) return {rest, {}};
  return {rest.substr(0, slash), last};
}

std::shared_ptr<Watch> require_encoder(const Fleet& fleet, std::string_view name) {
  if (std::shared_ptr<Watch> watch = fleet.find(name)) return watch;
  const std::size_t slash = name.rfind('/');
  if (slash != std::string_view::npos && fleet.find(name.substr(0, slash)) != nullptr) {
    const std::string_view part = name.substr(slash + 1);
    throw NotFound(fmt::format("an encoder has no \"{}\"{}", part, suggestion(part, parts_of_encoder)));
  }
  const Fleet::Watches watches = fleet.all();
  std::vector<std::string_view> names;
  for (const auto& watch : watches) names.push_back(watch->name());
  throw NotFound(fmt::format("there is no encoder \"{}\" here{}", name, suggestion(name, names)));
}

std::string unknown_path(const Request& request) {
  constexpr std::string_view api = "/api/";
  const std::string_view path = request.path;
  if (path.starts_with(api)) {
    const std::string_view last = path.substr(api.size());
    if (last == "encoder") return "this path is now /api/encoders/NAME";
    if (std::find(parts_of_encoder.begin(), parts_of_encoder.end(), last) != parts_of_encoder.end()) {
      return fmt::format("this path is now {}NAME/{}", encoders_path, last);
    }
  }
  return "this path is unknown: /openapi.json describes all paths";
}

std::vector<std::int64_t> arguments_in(const Request& request, const Command& command) {
  std::vector<std::string> written;
  const auto [first, last] = request.query.equal_range("argument");
  for (auto one = first; one != last; ++one) written.push_back(one->second);
  return require_arguments(command, written);
}

}  // namespace

Json state_json(const Fleet& fleet, const Chronicler* chronicler) {
  const Json encoders = Json::list(fleet.all(), [](const auto& one) { return overview(*one, one->snapshot()); });
  Json history;
  if (chronicler != nullptr) {
    const Chronicler::Health health = chronicler->health();
    history = Json::object().set("trouble", health.trouble).set("lost", health.lost);
  }
  return Json::object().set("at_ms", calendar_ms()).set("encoders", encoders).set("history", history);
}

Api::Api(Fleet& fleet, const Access& access, Streams& streams, Worker& worker, const ServerEvents& server_events,
         Chronicler* chronicler, const Sending& sending)
    : fleet_(&fleet),
      access_(&access),
      streams_(&streams),
      worker_(&worker),
      server_events_(&server_events),
      chronicler_(chronicler),
      sending_(&sending) {}

void Api::answer(Request request, const Reply& reply) {
  request.peer = access_->client_of(request);
  try {
    if (request.method == "GET" || request.method == "HEAD") return get(request, reply);
    if (request.method == "POST") return post(request, reply);
    Response response = error_response(405, "only GET and POST are supported");
    response.headers.emplace_back("Allow", "GET, HEAD, POST");
    reply.send(response);
  } catch (const NotFound& error) {
    reply.send(error_response(404, error.what()));
  } catch (const BadRequest& error) {
    reply.send(error_response(400, error.what()));
  } catch (const UsageError& error) {
    reply.send(error_response(400, error.what()));
  }
}

void Api::get(const Request& request, const Reply& reply) {
  const std::string& path = request.path;
  const Asset* asset = find_asset(path);
  const bool is_open = asset != nullptr || path == "/healthz";
  const bool is_of_encoder = path.starts_with(encoders_path);
  const Target target = is_of_encoder ? target_of(path) : Target{};
  const bool polls = target.part == "settings" || target.part == "memory";
  const Access::Right right = is_open ? Access::Right::open : polls ? Access::Right::poll : Access::Right::read;
  if (const auto refused = access_->refusal(request, right)) return reply.send(*refused);
  if (asset != nullptr) return reply.send({200, std::string(asset->type), std::string(asset->content)});
  if (is_of_encoder) return get_of(require_encoder(*fleet_, target.name), target.part, request, reply);
  if (path == "/healthz") return reply.send(health());
  if (path == "/metrics") {
    ServerFigures figures{streams_->count(), streams_->dropped(), 0, access_->wrong_tokens()};
    if (chronicler_ != nullptr) figures.history_lost = chronicler_->health().lost;
    return reply.send(
        {200, "text/plain; version=0.0.4; charset=utf-8", metrics(fleet_->all(), figures) + sending_->metrics()});
  }
  if (path == "/api/encoders") return reply.send(json_response(state_json(*fleet_, chronicler_)));
  if (path == "/api/minute") return reply.send(json_response(last_minute(fleet_->all())));
  if (path == "/api/token") return reply.send(token(request));
  const bool wants_all = request.value("encoder").empty() && request.value("trace").empty();
  if (path == "/api/stream" && wants_all && request.method == "GET") return stream("", request, reply);
  if (path == "/api/events" && wants_all) return past("", true, request, reply);
  if (path == "/api/mqtt") return reply.send(json_response(sending_->json()));
  throw NotFound(unknown_path(request));
}

void Api::get_of(const std::shared_ptr<Watch>& watch, std::string_view part, const Request& request,
                 const Reply& reply) {
  if (part.empty()) return reply.send(json_response(details(*watch)));
  if (part == "history" || part == "events") return past(watch->name(), part == "events", request, reply);
  if (part == "points") return reply.send(json_response(points(*watch, watch->recent_points())));
  if (part == "history.csv") return past_as_csv(watch->name(), request, reply);
  const bool needs_post = part == "command" || part == "doctor" || part == "acknowledge";
  if (needs_post || request.method == "HEAD") {
    const std::string_view method = needs_post ? "POST" : "GET";
    Response response = error_response(405, fmt::format("{} needs the method {}", part, method));
    response.headers.emplace_back("Allow", method);
    return reply.send(response);
  }
  if (part == "stream") return stream(watch->name(), request, reply);
  const Unit& unit = *watch->address().unit;
  if (part == "settings") return give(*watch, settings_order(unit, request.value("setting")), request, reply);
  give(*watch, memory_order(unit, number_in(request, "page", -1, 0, UINT16_MAX)), request, reply);
}

void Api::post(const Request& request, const Reply& reply) {
  const bool is_of_encoder = request.path.starts_with(encoders_path);
  const Target target = is_of_encoder ? target_of(request.path) : Target{};
  const Access::Right right = target.part == "doctor" ? Access::Right::poll : Access::Right::change;
  if (const auto refused = access_->refusal(request, right)) return reply.send(*refused);
  if (!is_of_encoder) throw NotFound(unknown_path(request));
  const std::shared_ptr<Watch> watch = require_encoder(*fleet_, target.name);
  if (target.part == "doctor") return doctor(*watch, request, reply);
  if (target.part == "command") return command(*watch, request, reply);
  if (target.part == "acknowledge") return acknowledge(*watch, request, reply);
  Response response = error_response(405, "only command, doctor and acknowledge take the method POST");
  response.headers.emplace_back("Allow", "GET, HEAD");
  reply.send(response);
}

// Returns the response to a health check; faults of encoders are in /metrics.
Response Api::health() const {
  std::size_t live = 0;
  const Fleet::Watches watches = fleet_->all();
  for (const auto& watch : watches) live += watch->snapshot().state == State::live ? 1 : 0;
  const Chronicler::Health history = chronicler_ != nullptr ? chronicler_->health() : Chronicler::Health{};
  const MqttHealth mqtt = sending_->mqtt_health();
  return json_response(Json::object()
                           .set("ok", history.trouble.empty() && mqtt.state() != "failing")
                           .set("encoders", watches.size())
                           .set("live", live)
                           .set("history", chronicler_ == nullptr    ? "none"
                                           : history.trouble.empty() ? "good"
                                                                     : "failing")
                           .set("history_lost", history.lost)
                           .set("mqtt", mqtt.state())
                           .set("mqtt_client_deaths", mqtt.client_deaths)
                           .set("mqtt_dropped", mqtt.dropped));
}

// Returns the response that tells a client the name of its token; refuses a wrong token.
Response Api::token(const Request& request) const {
  const std::string who = access_->token_name(request);
  if (who.empty() && !request.authorization.empty()) return access_->refuse_token(request);
  return json_response(
      Json::object().set("tokens", access_->has_tokens()).set("name", who.empty() ? Json() : Json(who)));
}

void Api::stream(const std::string& trace, const Request& request, const Reply& reply) {
  const std::shared_ptr<Stream> stream = streams_->open(trace, request.peer);
  if (stream == nullptr) return reply.send(error_response(503, "too many streams are open"));
  reply.send(stream);
}

void Api::command(Watch& watch, const Request& request, const Reply& reply) {
  const Command& wanted = require_command(*watch.address().unit, request.value("command"));
  if (wanted.verb == Verb::scan) throw BadRequest("a scan needs a line without encoders that this server reads");
  Order order;
  order.command = &wanted;
  order.arguments = arguments_in(request, wanted);
  order.done = [reply](const OrderResult& done) {
    Json json = Json::object().set("ok", done.good).set("text", done.text).set("fields", done.json);
    if (done.change != ChangeState::none) json.set("change", word_of(done.change));
    reply.send({done.good ? 200U : 502U, "application/json", json.line() + "\n"});
  };
  give(watch, std::move(order), request, reply);
}

// Acknowledges an alarm. The alarm stays raised, because only the encoder can clear it.
void Api::acknowledge(Watch& watch, const Request& request, const Reply& reply) {
  const std::string alarm = request.value("alarm");
  if (alarm.empty()) throw BadRequest("alarm must name the alarm that is acknowledged");
  const std::string token = access_->token_name(request);
  const std::string refused = watch.acknowledge(alarm, token, fmt::format("{} from {}", token, request.peer));
  if (!refused.empty()) return reply.send(error_response(409, refused));
  const auto answer = [reply, alarm, token] {
    reply.send(json_response(Json::object().set("ok", true).set("alarm", alarm).set("who", token)));
  };
  if (chronicler_ == nullptr) return answer();
  chronicler_->when_written(server_events_->added(), answer);
}

// An examination opens the port again, which would stop the readings of other encoders on the line.
void Api::doctor(Watch& watch, const Request& request, const Reply& reply) {
  const std::vector<std::string> others = fleet_->others_on_line(watch);
  if (others.empty()) return give(watch, examination_order(), request, reply);
  reply.send(error_response(
      409, fmt::format("{} shares its line with {}, whose readings would stop too: end this server, then run "
                       "`absenc doctor \"{}\"`",
                       watch.name(), fmt::join(others, ", "), watch.name())));
}

// Queues `order` for the encoder that `watch` reads. If `watch` refuses the order, the response has HTTP status 409.
void Api::give(Watch& watch, Order order, const Request& request, const Reply& reply) {
  const std::string who = access_->token_name(request);
  order.who = who.empty() ? request.peer : fmt::format("{} from {}", who, request.peer);
  if (!order.done) {
    order.done = [reply](const OrderResult& done) {
      reply.send(done.good ? json_response(done.json) : error_response(502, done.text));
    };
  }
  // The response to a command waits until the history has recorded who ran the command, or cannot record it.
  if (chronicler_ != nullptr && order.kind == Order::Kind::command) {
    order.done = [chronicler = chronicler_, server_events = server_events_,
                  answer = std::move(order.done)](const OrderResult& done) {
      chronicler->when_written(server_events->added(), [answer, done] { answer(done); });
    };
  }
  const std::string_view refused = watch.give(std::move(order));
  if (!refused.empty()) reply.send(error_response(409, refused));
}

void Api::past(const std::string& encoder, bool events, const Request& request, const Reply& reply) {
  if (chronicler_ == nullptr) return reply.send(error_response(404, "the server stores no history: see --history"));
  const Range range = range_in(request);
  const std::int64_t rows = number_in(request, "rows", 1000, 1, most_rows);
  const auto job = [reader = &chronicler_->reader(), range, rows, encoder, events, reply] {
    try {
      reply.send(
          json_response(events ? reader->server_events(encoder, range, rows) : reader->seconds(encoder, range, rows)));
    } catch (const std::exception& error) {
      reply.send(error_response(503, error.what()));
    }
  };
  if (!worker_->add(job)) reply.send(error_response(503, "too many requests for history are waiting: try again later"));
}

void Api::past_as_csv(const std::string& encoder, const Request& request, const Reply& reply) {
  if (chronicler_ == nullptr) return reply.send(error_response(404, "the server stores no history: see --history"));
  struct Rest {
    std::string encoder;
    Range range;
    std::weak_ptr<Stream> stream{};
  };
  const auto rest = std::make_shared<Rest>(Rest{encoder, range_in(request)});
  // Queues the next rows of a CSV response; runs each time all queued rows of this response are sent.
  const auto next = [reader = &chronicler_->reader(), rest] {
    const std::shared_ptr<Stream> stream = rest->stream.lock();
    if (stream == nullptr || stream->over()) return;
    try {
      auto [text, from_s] = reader->csv(rest->encoder, rest->range, rows_of_a_page);
      rest->range.from_s = from_s;
      if (!text.empty()) stream->push(std::make_shared<const std::string>(std::move(text)));
    } catch (const std::exception& error) {
      stream->push(std::make_shared<const std::string>(fmt::format("# broken off: {}\n", error.what())));
      rest->range.from_s = rest->range.to_s + 1;
    }
    if (rest->range.from_s > rest->range.to_s) stream->end();
  };
  const auto stream = std::make_shared<Stream>("text/csv; charset=utf-8; header=present", 4,
                                               [worker = worker_, next] { worker->add(next, true); });
  rest->stream = stream;
  stream->push(std::make_shared<const std::string>(HistoryReader::csv_header()));
  reply.send(stream);
}

}  // namespace absenc::serve
