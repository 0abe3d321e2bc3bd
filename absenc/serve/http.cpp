// SPDX-License-Identifier: Apache-2.0
// An HTTP server on libmicrohttpd. A request that waits for its answer is a suspended connection, which needs no
// thread.
#include "absenc/serve/http.hpp"

#include <microhttpd.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "absenc/client/error.hpp"
#include "absenc/os/signals.hpp"
#include "absenc/serve/connections.hpp"
#include "absenc/serve/http_request.hpp"

namespace absenc::serve {

namespace {

// Limit of libmicrohttpd for open connections, at which it would accept no more. The limit is never reached, because
// `Connections` closes connections at a lower number.
constexpr unsigned most_connections = Connections::most + Connections::reserve + 64;
// Memory of each connection in bytes, for headers and unsent output.
constexpr std::size_t memory_for_each = 64 * 1024;
// Greatest size of a request body in bytes; no request to this server needs a body.
constexpr std::uint64_t most_body = 4096;
// Greatest number of bytes that are read of a request body without announced length; then the connection is closed.
constexpr std::uint64_t most_read = 1 << 20;
constexpr unsigned idle_seconds = 15;
constexpr std::size_t block = 16 * 1024;

Headers headers_of(MHD_Connection* connection) {
  Headers headers;
  const auto add = [](void* into, MHD_ValueKind, const char* name, const char* value) {
    static_cast<Headers*>(into)->add(name, value == nullptr ? "" : value);
    return MHD_YES;
  };
  ::MHD_get_connection_values(connection, MHD_HEADER_KIND, add, &headers);
  return headers;
}

std::string peer_of(MHD_Connection* connection) {
  const MHD_ConnectionInfo* info = ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
  return info != nullptr && info->client_addr != nullptr ? os::host_text(*info->client_addr) : std::string();
}

int socket_of(MHD_Connection* connection) {
  const MHD_ConnectionInfo* info = ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
  return info != nullptr ? static_cast<int>(info->connect_fd) : -1;
}

Request request_of(MHD_Connection* connection, const char* path, const char* method) {
  Request request;
  request.method = method;
  request.path = path;
  const auto add = [](void* query, MHD_ValueKind, const char* name, const char* value) {
    static_cast<decltype(Request::query)*>(query)->emplace(name, value == nullptr ? "" : value);
    return MHD_YES;
  };
  ::MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, add, &request.query);
  headers_of(connection).copy_to(request);
  request.peer = peer_of(connection);
  return request;
}

void add_headers(MHD_Response* response, const std::string& type) {
  ::MHD_add_response_header(response, "Content-Type", type.c_str());
  ::MHD_add_response_header(response, "Cache-Control", "no-store");
  ::MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
  ::MHD_add_response_header(response, "Referrer-Policy", "no-referrer");
  // Inline styles are allowed, because Dygraphs inserts style elements into the document.
  ::MHD_add_response_header(response, "Content-Security-Policy",
                            "default-src 'self'; style-src 'self' 'unsafe-inline'; base-uri 'none'; "
                            "form-action 'none'; frame-ancestors 'none'");
}

}  // namespace

// ---- Streams

struct Stream::Sending {
  std::string type;
  std::size_t most;
  std::function<void()> on_empty;

  std::mutex mutex;  // mutex that guards all members below
  std::deque<Text> queue;
  std::size_t sent_of_first = 0;
  MHD_Connection* suspended = nullptr;
  int socket = -1;  // socket of the connection that sends this stream; -1 while there is none
  Time taken_at = os::now();
  bool ended = false;  // whether no more texts will be added to the queue
  bool over = false;   // whether the connection of the stream has ended
  std::uint64_t dropped = 0;

  // Resumes the connection of the stream if it is suspended. The caller must hold the mutex.
  void resume() {
    if (suspended != nullptr) ::MHD_resume_connection(std::exchange(suspended, nullptr));
  }

  ssize_t take(MHD_Connection* connection, char* buffer, std::size_t size) {
    {
      const std::lock_guard lock(mutex);
      taken_at = os::now();
      if (!queue.empty()) return fill_buffer(buffer, size);
      if (ended) return MHD_CONTENT_READER_END_OF_STREAM;
      suspended = connection;
      ::MHD_suspend_connection(connection);
    }
    if (on_empty) on_empty();
    return 0;
  }

  ssize_t fill_buffer(char* buffer, std::size_t size) {
    std::size_t filled = 0;
    while (!queue.empty() && filled < size) {
      const std::string& first = *queue.front();
      const std::size_t count = std::min(size - filled, first.size() - sent_of_first);
      std::memcpy(buffer + filled, first.data() + sent_of_first, count);
      filled += count;
      sent_of_first += count;
      if (sent_of_first < first.size()) break;
      queue.pop_front();
      sent_of_first = 0;
    }
    return static_cast<ssize_t>(filled);
  }
};

Stream::Stream(std::string type, std::size_t most, std::function<void()> on_empty)
    : sending_(std::make_unique<Sending>()) {
  sending_->type = std::move(type);
  sending_->most = most;
  sending_->on_empty = std::move(on_empty);
}
Stream::~Stream() = default;

void Stream::push(Text text) {
  const std::lock_guard lock(sending_->mutex);
  if (sending_->over || sending_->ended || text->empty()) return;
  std::deque<Text>& queue = sending_->queue;
  queue.push_back(std::move(text));
  // A full queue drops its second text, because the first one may be partly sent.
  if (queue.size() > std::max<std::size_t>(sending_->most, 2)) {
    queue.erase(queue.begin() + 1);
    ++sending_->dropped;
  }
  sending_->resume();
}

void Stream::end() {
  const std::lock_guard lock(sending_->mutex);
  sending_->ended = true;
  sending_->resume();
}

void Stream::abort() {
  const std::lock_guard lock(sending_->mutex);
  sending_->ended = true;
  sending_->queue.clear();
  sending_->sent_of_first = 0;
  if (sending_->socket >= 0) os::end_connection(sending_->socket);
  sending_->resume();
}

bool Stream::over() const {
  const std::lock_guard lock(sending_->mutex);
  return sending_->over;
}

std::uint64_t Stream::dropped() const {
  const std::lock_guard lock(sending_->mutex);
  return sending_->dropped;
}

Time Stream::taken_at() const {
  const std::lock_guard lock(sending_->mutex);
  return sending_->taken_at;
}

// ---- Replies

struct Reply::Exchange {
  bool called = false;
  std::uint64_t body = 0;

  std::mutex mutex;  // mutex that guards all members below
  std::optional<Response> response;
  std::shared_ptr<Stream> stream;
  MHD_Connection* suspended = nullptr;
  bool over = false;

  void answer(std::optional<Response> given, std::shared_ptr<Stream> streamed) {
    const std::lock_guard lock(mutex);
    if (over || response || stream) return;
    response = std::move(given);
    stream = std::move(streamed);
    if (suspended != nullptr) ::MHD_resume_connection(std::exchange(suspended, nullptr));
  }
};

void Reply::send(Response response) const { exchange_->answer(std::move(response), nullptr); }
void Reply::send(std::shared_ptr<Stream> stream) const { exchange_->answer({}, std::move(stream)); }

// ---- The server

struct HttpServer::Daemon {
  using Exchange = Reply::Exchange;

  Handler handler;
  std::vector<std::string> vital;
  os::Listener listener;
  MHD_Daemon* daemon = nullptr;

  std::mutex mutex;  // mutex that guards all members below
  bool ending = false;
  Connections connections{os::end_connection};
  std::unordered_map<Exchange*, std::weak_ptr<Exchange>> exchanges;
  std::unordered_map<Stream*, std::weak_ptr<Stream>> streams;

  static MHD_Result queue(MHD_Connection* connection, const Response& answer) {
    MHD_Response* response = ::MHD_create_response_from_buffer(
        answer.body.size(), const_cast<char*>(answer.body.data()), MHD_RESPMEM_MUST_COPY);
    if (response == nullptr) return MHD_NO;
    add_headers(response, answer.type);
    for (const auto& [name, value] : answer.headers) ::MHD_add_response_header(response, name.c_str(), value.c_str());
    const MHD_Result queued = ::MHD_queue_response(connection, answer.status, response);
    ::MHD_destroy_response(response);
    return queued;
  }

  struct StreamContext {
    Daemon* daemon;
    MHD_Connection* connection;
    std::shared_ptr<Stream> stream;
  };

  static ssize_t read_stream(void* context, std::uint64_t, char* buffer, std::size_t size) {
    const auto* one = static_cast<StreamContext*>(context);
    return one->stream->sending_->take(one->connection, buffer, size);
  }

  static void free_stream(void* context) {
    const std::unique_ptr<StreamContext> one(static_cast<StreamContext*>(context));
    {
      const std::lock_guard lock(one->daemon->mutex);
      one->daemon->streams.erase(one->stream.get());
    }
    Stream::Sending& sending = *one->stream->sending_;
    const std::lock_guard lock(sending.mutex);
    sending.over = true;
    sending.suspended = nullptr;
    sending.socket = -1;
    sending.queue.clear();
  }

  MHD_Result queue(MHD_Connection* connection, const std::shared_ptr<Stream>& stream) {
    {
      const std::lock_guard lock(mutex);
      if (ending) stream->end();
      streams.emplace(stream.get(), stream);
    }
    {
      const std::lock_guard lock(stream->sending_->mutex);
      stream->sending_->socket = socket_of(connection);
    }
    MHD_Response* response = ::MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, block, read_stream, new StreamContext{this, connection, stream}, free_stream);
    if (response == nullptr) return MHD_NO;
    add_headers(response, stream->sending_->type);
    const MHD_Result queued = ::MHD_queue_response(connection, MHD_HTTP_OK, response);
    ::MHD_destroy_response(response);
    return queued;
  }

  // Hands the answer to a request to libmicrohttpd, or suspends the connection until the answer is known.
  MHD_Result respond(MHD_Connection* connection, Exchange& exchange) {
    const std::lock_guard lock(exchange.mutex);
    if (exchange.response) return queue(connection, *exchange.response);
    if (exchange.stream) return queue(connection, exchange.stream);
    exchange.suspended = connection;
    ::MHD_suspend_connection(connection);
    return MHD_YES;
  }

  void call(MHD_Connection* connection, const char* path, const char* method,
            const std::shared_ptr<Exchange>& exchange) {
    {
      const std::lock_guard lock(mutex);
      connections.begin_request(connection);
      const bool is_vital = std::find(vital.begin(), vital.end(), path) != vital.end();
      if (connections.is_in_reserve(connection) && !is_vital) {
        return exchange->answer(
            Response{503, "text/plain", "too many connections are open: try again later\n", {{"Connection", "close"}}},
            nullptr);
      }
      exchanges.emplace(exchange.get(), exchange);
      if (ending) return exchange->answer(Response{503, "text/plain", "the server is shutting down\n"}, nullptr);
    }
    // If all copies of `reply` are destroyed without an answer, the deleter of the last one answers with status 500.
    const Reply reply(std::shared_ptr<Exchange>(exchange.get(), [exchange](Exchange*) {
      exchange->answer(Response{500, "text/plain", "the request got no answer\n"}, nullptr);
    }));
    try {
      handler(request_of(connection, path, method), reply);
    } catch (const std::exception& error) {
      reply.send(Response{500, "text/plain", std::string(error.what()) + "\n"});
    }
  }

  static MHD_Result access(void* self, MHD_Connection* connection, const char* path, const char* method,
                           const char* version, const char*, std::size_t* size, void** context) {
    auto& daemon = *static_cast<Daemon*>(self);
    if (*context == nullptr) {
      *context = new std::shared_ptr<Exchange>(std::make_shared<Exchange>());
      const Headers headers = headers_of(connection);
      if (const std::string_view wrong = headers.ambiguity(version); !wrong.empty()) {
        return queue(connection, {MHD_HTTP_BAD_REQUEST,
                                  "text/plain",
                                  "the request is ambiguous: " + std::string(wrong) + "\n",
                                  {{"Connection", "close"}}});
      }
      const bool announced = headers.announced_length() > most_body;
      return announced ? queue(connection, too_large()) : MHD_YES;
    }
    const auto& exchange = *static_cast<std::shared_ptr<Exchange>*>(*context);
    if (*size != 0) {
      exchange->body += std::exchange(*size, 0);
      return exchange->body > most_read ? MHD_NO : MHD_YES;
    }
    if (exchange->body > most_body) return queue(connection, too_large());
    if (!std::exchange(exchange->called, true)) daemon.call(connection, path, method, exchange);
    return daemon.respond(connection, *exchange);
  }

  static Response too_large() {
    return {MHD_HTTP_CONTENT_TOO_LARGE, "text/plain", "no request to this server has a body\n"};
  }

  static void completed(void* self, MHD_Connection* connection, void** context, MHD_RequestTerminationCode) {
    auto& daemon = *static_cast<Daemon*>(self);
    {
      const std::lock_guard lock(daemon.mutex);
      daemon.connections.await_request(connection, os::now());
    }
    if (*context == nullptr) return;
    const std::unique_ptr<std::shared_ptr<Exchange>> exchange(static_cast<std::shared_ptr<Exchange>*>(*context));
    *context = nullptr;
    {
      const std::lock_guard lock(daemon.mutex);
      daemon.exchanges.erase(exchange->get());
    }
    const std::lock_guard lock((*exchange)->mutex);
    (*exchange)->over = true;
    (*exchange)->suspended = nullptr;
  }

  static void connected(void* self, MHD_Connection* connection, void**, MHD_ConnectionNotificationCode code) {
    auto& daemon = *static_cast<Daemon*>(self);
    const std::lock_guard lock(daemon.mutex);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) return daemon.connections.remove(connection);
    daemon.connections.add(connection, socket_of(connection), peer_of(connection), os::now());
  }

  void start() {
    const auto socket = static_cast<MHD_socket>(os::release_socket(listener.socket));  // libmicrohttpd closes it
    daemon = ::MHD_start_daemon(
        MHD_USE_AUTO | MHD_USE_INTERNAL_POLLING_THREAD | MHD_ALLOW_SUSPEND_RESUME, listener.port, nullptr, nullptr,
        &access, this, MHD_OPTION_LISTEN_SOCKET, socket, MHD_OPTION_CONNECTION_LIMIT, most_connections,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, memory_for_each, MHD_OPTION_CONNECTION_TIMEOUT, idle_seconds,
        MHD_OPTION_NOTIFY_COMPLETED, &completed, this, MHD_OPTION_NOTIFY_CONNECTION, &connected, this, MHD_OPTION_END);
    if (daemon == nullptr)
      throw client::Failure("the web server cannot be started: too many files are open, or no memory");
  }

  // libmicrohttpd must not be stopped while connections are suspended.
  void stop() {
    ::MHD_quiesce_daemon(daemon);
    std::vector<std::shared_ptr<Exchange>> waiting;
    std::vector<std::shared_ptr<Stream>> streaming;
    {
      const std::lock_guard lock(mutex);
      ending = true;
      for (const auto& one : exchanges) waiting.push_back(one.second.lock());
      for (const auto& one : streams) streaming.push_back(one.second.lock());
    }
    for (const auto& one : waiting) {
      if (one) one->answer(Response{503, "text/plain", "the server is shutting down\n"}, nullptr);
    }
    for (const auto& one : streaming) {
      if (one) one->end();
    }
    ::MHD_stop_daemon(daemon);
  }
};

HttpServer::HttpServer(os::Listener listener, Handler handler, std::vector<std::string> vital)
    : daemon_(std::make_unique<Daemon>()) {
  daemon_->vital = std::move(vital);
  daemon_->listener = std::move(listener);
  daemon_->handler = std::move(handler);
  daemon_->start();
}

HttpServer::~HttpServer() { daemon_->stop(); }

void HttpServer::end_incomplete_requests() {
  const std::lock_guard lock(daemon_->mutex);
  daemon_->connections.end_incomplete_requests(os::now());
}

}  // namespace absenc::serve
