// SPDX-License-Identifier: Apache-2.0
// One encoder read again and again by a thread of its own; others look at copies of what is known of it.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absenc/client/encoder.hpp"
#include "absenc/client/port/address.hpp"
#include "absenc/client/text/json.hpp"
#include "absenc/serve/order.hpp"
#include "absenc/serve/outbox.hpp"
#include "absenc/serve/server_event.hpp"
#include "absenc/serve/time_series.hpp"

namespace absenc::serve {

enum class State : std::uint8_t {
  opening,   // its port was not there yet
  live,      // the reading is new
  silent,    // none has come for a while
  failing,   // the last attempt failed
  lost,      // the port has gone away
  ended,     // it cannot be read as it is: `message` says why. It is tried again every few seconds
  examined,  // an examination has its port; `message` says what it looks at
};
[[nodiscard]] std::string_view name_of(State state);

/// Up to which latencies are counted, by 1, 2 and 5 from 10 us to 1 s.
inline constexpr std::array<Time, 16> latency_limits = [] {
  std::array<Time, 16> limits{};
  std::int64_t decade = 10'000;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    constexpr std::array<std::int64_t, 3> steps{1, 2, 5};
    limits[i] = Time(decade * steps[i % 3]);
    if (i % 3 == 2) decade *= 10;
  }
  return limits;
}();

struct LatencyFigures {
  Time median{};
  Time percentile_99{};
  Time longest{};
  std::array<std::uint64_t, latency_limits.size()> within{};  // how many do not exceed each limit
  std::uint64_t count = 0;
  Time sum{};
};

/// An alarm that is raised, and who has seen it. Acknowledged is not cleared.
struct RaisedAlarm {
  std::string_view channel{};  // name of the field with the alarms of a channel
  std::string_view name{};
  std::int64_t since_ms = 0;      // calendar
  std::string acknowledged_by{};  // "": by nobody
  std::int64_t acknowledged_ms = 0;
};

/// What is known of an encoder at a moment.
struct Snapshot {
  State state = State::opening;
  Time age{};  // of the reading, or of what is known instead
  bool has_reading = false;
  std::optional<double> place{};  // of the last position that held, as in `Point`
  client::Sample last{};          // only to be shown as the present one while `live`
  std::string message{};          // why it is not
  host::Counters counters{};
  std::uint64_t readings = 0;
  std::uint64_t losses = 0;
  std::uint64_t restarts = 0;  // of the position
  std::uint64_t errors_last_minute = 0;
  std::vector<RaisedAlarm> raised{};
  double rate = 0;           // readings a second
  LatencyFigures latency{};  // at most a second old
};

/// What only those ask for who look at one encoder.
struct Details {
  std::vector<client::BadExchangeText> bad{};  // the newest first
  client::Json fields{};                       // of the last reply, at most a second old
  client::Json reply{};                        // the same for people: `shown_values`
};

class Watch {
 public:
  /// The first reading comes `offset` after the start. `server_events` outlives it.
  Watch(std::string name, const client::EncoderAddress& address, double rate, Time offset, ServerEvents& server_events);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// It ends within the time that one reading may take.
  void request_stop() { thread_.request_stop(); }
  /// Until it has ended; the destructor does both.
  void wait();

  [[nodiscard]] Snapshot snapshot() const;
  [[nodiscard]] Details details() const;
  /// The functions of TimeSeries, for any thread.
  void trace(bool on);
  [[nodiscard]] std::vector<Point> take_points();
  [[nodiscard]] std::vector<Point> recent_points() const;
  [[nodiscard]] std::vector<Second> take_seconds();
  [[nodiscard]] std::vector<Second> last_minute() const;

  /// All good readings since the last time: each of those who send them on has them all.
  enum class Outlet : std::uint8_t { mqtt, udp };
  [[nodiscard]] Outbox::Taken take_passing(Outlet outlet);
  /// Nobody takes them any more.
  void stop_passing(Outlet outlet);

  /// "", or why it is not taken: another waits, an examination runs, or it has ended.
  [[nodiscard]] std::string_view give(Order order);

  /// Keeps who has seen the alarm of this name, in all channels, until it is over. `who` stands in the history. Returns
  /// "", or why it is refused: the alarm is not raised.
  [[nodiscard]] std::string acknowledge(std::string_view alarm, const std::string& token, const std::string& who);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const client::EncoderAddress& address() const { return address_; }
  [[nodiscard]] double rate() const { return rate_; }

 private:
  void work(const std::stop_token& stop);
  void read_on(const std::stop_token& stop);
  void publish(const client::Encoder& live, const client::Sample& sample);
  void summarize(const client::Encoder& live, const client::Sample& sample);
  void pass_on(const client::Sample& sample);
  void tell_alarms(const Reading& reading);
  void become(State state, const std::string& message);
  void carry_out(client::Encoder& live, const Order& order, const std::function<void()>& between,
                 const std::stop_token& stop);
  [[nodiscard]] Done examine(client::Encoder& live, const std::stop_token& stop);
  void open_again(client::Encoder& live);
  void refuse_order(const std::string& why);
  void take_orders(bool on);
  [[nodiscard]] State state_now(Time age) const;
  void tell(std::string_view kind, std::string text, std::string who = {});

  std::string name_;
  client::EncoderAddress address_;
  double rate_;
  Time offset_;
  ServerEvents* server_events_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  Snapshot known_;
  Details details_;
  Time known_at_{};  // of the last reading, or of the last change of state
  std::optional<Order> order_;
  bool over_ = false;      // nobody takes orders any more
  bool examines_ = false;  // and takes none meanwhile
  TimeSeries series_;
  std::array<Outbox, 2> outboxes_;  // by Outlet

  // Of the thread alone.
  Time next_summary_{};
  Time next_told_{};  // of failures
  std::uint32_t alarms_ = 0;
  bool restarted_ = false;
  bool command_runs_ = false;  // it is not broken off

  std::jthread thread_;  // last: it uses all of the others
};

}  // namespace absenc::serve
