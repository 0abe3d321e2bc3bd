// SPDX-License-Identifier: Apache-2.0
// HTTP API of `absenc serve`, and the files of its page.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absenc/serve/access.hpp"
#include "absenc/serve/chronicler.hpp"
#include "absenc/serve/fleet.hpp"
#include "absenc/serve/history.hpp"
#include "absenc/serve/http.hpp"
#include "absenc/serve/sending.hpp"
#include "absenc/serve/streams.hpp"
#include "absenc/serve/worker.hpp"

namespace absenc::serve {

/// Returns the state of all encoders as JSON, as in the event `state` of the event stream. `chronicler` is null
/// without a history.
[[nodiscard]] client::Json state_json(const Fleet& fleet, const Chronicler* chronicler);

class Api {
 public:
  /// All arguments must outlive this object. `chronicler` is null without a history.
  Api(Fleet& fleet, const Access& access, Streams& streams, Worker& worker, const ServerEvents& server_events,
      Chronicler* chronicler, const Sending& sending);

  void answer(Request request, const Reply& reply);

 private:
  void get(const Request& request, const Reply& reply);
  void post(const Request& request, const Reply& reply);
  [[nodiscard]] Response health() const;
  [[nodiscard]] Response token(const Request& request) const;
  void get_of(const std::shared_ptr<Watch>& watch, std::string_view part, const Request& request, const Reply& reply);
  void stream(const std::string& trace, const Request& request, const Reply& reply);
  void command(Watch& watch, const Request& request, const Reply& reply);
  void acknowledge(Watch& watch, const Request& request, const Reply& reply);
  void doctor(Watch& watch, const Request& request, const Reply& reply);
  void give(Watch& watch, Order order, const Request& request, const Reply& reply);
  void past(const std::string& encoder, bool events, const Request& request, const Reply& reply);
  void past_as_csv(const std::string& encoder, const Request& request, const Reply& reply);

  Fleet* fleet_;
  const Access* access_;
  Streams* streams_;
  Worker* worker_;
  const ServerEvents* server_events_;
  Chronicler* chronicler_;
  const Sending* sending_;
};

}  // namespace absenc::serve
