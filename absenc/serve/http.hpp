// SPDX-License-Identifier: Apache-2.0
// HTTP, apart from what is served: one thread for all connections, answers from any thread, limits for everything that
// a client can do. The library behind it is seen by http.cpp and http_request.cpp alone.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absenc/core/time.hpp"
#include "absenc/os/listener.hpp"

namespace absenc::serve {

struct Request {
  std::string method;  // "GET", "POST" ...
  std::string path;
  std::multimap<std::string, std::string> query;
  std::string peer;  // the address of whoever asks
  std::string host;  // headers; "" where there is none
  std::string origin;
  std::string fetch_site;
  std::string authorization;
  bool is_forwarded = false;  // a header says that a proxy passed it on
  std::string forwarded_for;  // X-Forwarded-For, where there is one

  /// The first of this name, or "".
  [[nodiscard]] std::string value(const std::string& name) const;
};

struct Response {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};
};

/// A body that is made while it is sent: texts wait in a bounded queue until the client has taken those before. A
/// client that is too slow loses the oldest, and nobody waits for it.
class Stream {
 public:
  using Text = std::shared_ptr<const std::string>;

  /// `wanted` is called from the thread of the connections when nothing is left to send; it must return soon.
  explicit Stream(std::string type, std::size_t most = 64, std::function<void()> wanted = {});
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void push(Text text);
  /// What is in the queue is sent first.
  void end();
  /// Ends the connection at once, also of a client that takes nothing.
  void break_off();
  /// Nobody takes it any more.
  [[nodiscard]] bool over() const;
  [[nodiscard]] std::uint64_t dropped() const;
  /// When the client last took something.
  [[nodiscard]] Time taken_at() const;

 private:
  friend class HttpServer;
  struct Sending;
  std::unique_ptr<Sending> sending_;
};

/// Answers one request, from any thread, at once or later; only the first answer counts. When the last copy goes
/// without one, the answer is 500.
class Reply {
 public:
  void send(Response response) const;
  void send(std::shared_ptr<Stream> stream) const;

 private:
  friend class HttpServer;
  struct Exchange;
  explicit Reply(std::shared_ptr<Exchange> exchange) : exchange_(std::move(exchange)) {}
  std::shared_ptr<Exchange> exchange_;
};

class HttpServer {
 public:
  using Handler = std::function<void(const Request&, Reply)>;

  /// `handler` is called from the thread of the connections and must return soon. `vital`: paths that are answered
  /// however many connections are open. Throws Failure.
  HttpServer(os::Listener listener, Handler handler, std::vector<std::string> vital);
  /// Breaks off what is still being sent. Whoever streams must have ended before.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Ends connections whose request does not come to its end; to be called every second or so.
  void end_half_sent();

 private:
  struct Daemon;
  std::unique_ptr<Daemon> daemon_;
};

}  // namespace absenc::serve
