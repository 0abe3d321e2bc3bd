// SPDX-License-Identifier: Apache-2.0
// HTTP server without knowledge of encoders, with one thread for all connections. Only http.cpp uses libmicrohttpd.
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
  std::string method;  // HTTP method: "GET", "POST" ...
  std::string path;
  std::multimap<std::string, std::string> query;
  // IP address of the other end of the connection; Api replaces it by the client's address that a proxy reports
  std::string peer;
  std::string host;  // value of header Host; "" if it is missing; the same holds for the headers below
  std::string origin;
  std::string fetch_site;
  std::string authorization;
  bool is_forwarded = false;  // whether a header shows that a proxy forwarded the request
  std::string forwarded_for;  // header X-Forwarded-For; "" if it is missing or occurs twice

  /// Returns the first value of the query parameter `name`; "" if the query has none.
  [[nodiscard]] std::string value(const std::string& name) const;
};

struct Response {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};
};

/// The body of a response, produced while it is sent: a queue of texts. A full queue drops its second-oldest text.
class Stream {
 public:
  using Text = std::shared_ptr<const std::string>;

  /// `most`: greatest number of queued texts, at least 2. `on_empty` is called when the queue is empty; it runs in
  /// the thread that serves all connections, and must return quickly.
  explicit Stream(std::string type, std::size_t most = 64, std::function<void()> on_empty = {});
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void push(Text text);
  /// Ends the stream after the queued texts are sent.
  void end();
  /// Closes the connection of the stream at once, even if the client receives nothing.
  void abort();
  /// Returns whether the connection of the stream has ended.
  [[nodiscard]] bool over() const;
  [[nodiscard]] std::uint64_t dropped() const;
  /// Returns the time at which the connection last took data of the stream; before the first time, the time at which
  /// the stream was made.
  [[nodiscard]] Time taken_at() const;

 private:
  friend class HttpServer;
  struct Sending;
  std::unique_ptr<Sending> sending_;
};

/// The means to answer one HTTP request, from any thread; only the first answer counts.
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

  /// `handler` is called for each request; it runs in the thread of the connections and must return quickly. `vital`:
  /// paths that connections of the reserve may request. Throws client::Failure.
  HttpServer(os::Listener listener, Handler handler, std::vector<std::string> vital);
  /// Stops the server; responses that are being sent may be cut off.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Closes connections that wait too long for a complete request; to be called about once a second.
  void end_incomplete_requests();

 private:
  struct Daemon;
  std::unique_ptr<Daemon> daemon_;
};

}  // namespace absenc::serve
