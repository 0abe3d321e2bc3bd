// SPDX-License-Identifier: Apache-2.0
// Reads one encoder continuously in its own thread; other threads get copies of its state.
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
  opening,   // the encoder was not read yet; its port may be missing
  live,      // the last reading is recent
  silent,    // no reading was received for a while
  failing,   // the last attempt to read the encoder failed
  lost,      // the port of the encoder was lost
  ended,     // the encoder cannot be read: `message` reports why; the thread tries again every few seconds
  examined,  // an examination uses the port: `message` reports its current step
};
[[nodiscard]] std::string_view name_of(State state);

/// Upper limits of the latency histogram, in steps of 1, 2 and 5 from 10 us to 1 s.
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
  // number of replies within each limit of `latency_limits` (cumulative, as in Latencies::within)
  std::array<std::uint64_t, latency_limits.size()> within{};
  std::uint64_t count = 0;
  Time sum{};
};

/// A raised alarm and whether a user has acknowledged it. An acknowledged alarm is still raised.
struct RaisedAlarm {
  std::string_view channel{};  // name of the field that reports the alarm
  std::string_view name{};
  std::int64_t since_ms = 0;      // calendar time when the alarm was raised
  std::string acknowledged_by{};  // name of the token of the user who acknowledged the alarm; "": not acknowledged
  std::int64_t acknowledged_ms = 0;
};

/// A copy of the state of an encoder at one time.
struct Snapshot {
  State state = State::opening;
  Time age{};  // age of the last reading; before the first reading, time since the `Watch` was made
  bool has_reading = false;
  // last valid position, which continues past the end of a turn; degrees, for linear encoders mm
  std::optional<double> place{};
  client::Sample last{};  // last reading; current only in state `live`
  std::string message{};  // reason why the encoder is not live; "" if it is, or if none is known
  host::Counters counters{};
  std::uint64_t readings = 0;
  std::uint64_t losses = 0;
  std::uint64_t restarts = 0;  // number of readings at which `place` starts again, after a jump or a long pause
  std::uint64_t errors_last_minute = 0;
  std::vector<RaisedAlarm> raised{};
  double rate = 0;           // measured number of readings per second
  LatencyFigures latency{};  // latencies of the replies, updated at most once a second
};

/// Additional data for the detailed view of one encoder.
struct Details {
  std::vector<client::BadExchangeText> bad{};  // recent exchanges with a bad or missing reply, newest first
  client::Json fields{};                       // fields of a recent reply, updated at most once a second
  client::Json reply{};                        // the same fields as texts for people, as `shown_values` returns them
};

class Watch {
 public:
  /// Starts a thread that reads the encoder `rate` times per second; `rate` 0: as fast as possible. `offset`: time
  /// before the first reading. `server_events` must outlive this object.
  Watch(std::string name, const client::EncoderAddress& address, double rate, Time offset, ServerEvents& server_events);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Requests that the reading thread ends, and does not wait for it.
  void request_stop() { thread_.request_stop(); }
  /// Waits until the reading thread has ended. The destructor calls `request_stop` and `wait`.
  void wait();

  [[nodiscard]] Snapshot snapshot() const;
  [[nodiscard]] Details details() const;
  /// Thread-safe versions of the functions of TimeSeries with the same names: `trace` to `last_minute`.
  void trace(bool on);
  [[nodiscard]] std::vector<Point> take_points();
  [[nodiscard]] std::vector<Point> recent_points() const;
  [[nodiscard]] std::vector<Second> take_seconds();
  [[nodiscard]] std::vector<Second> last_minute() const;

  /// A kind of system to which readings are sent. Each outlet has its own queue of readings.
  enum class Outlet : std::uint8_t { mqtt, udp };
  [[nodiscard]] Outbox::Taken take_outgoing(Outlet outlet);
  /// Stops storing readings for `outlet` and drops the queued ones.
  void stop_outgoing(Outlet outlet);

  /// Gives an order to the reading thread. Returns "" or why the order is refused.
  [[nodiscard]] std::string_view give(Order order);

  /// Acknowledges the raised alarm named `alarm`, in all channels. Returns "" or the reason of a refusal. `who`: name
  /// of the user for the event.
  [[nodiscard]] std::string acknowledge(std::string_view alarm, const std::string& token, const std::string& who);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const client::EncoderAddress& address() const { return address_; }
  [[nodiscard]] double rate() const { return rate_; }

 private:
  void work(const std::stop_token& stop);
  void read_on(const std::stop_token& stop);
  void publish(const client::Encoder& live, const client::Sample& sample);
  void summarize(const client::Encoder& live, const client::Sample& sample);
  void queue_outgoing(const client::Sample& sample);
  void report_alarms(const Reading& reading);
  void set_state(State state, const std::string& message);
  void carry_out(client::Encoder& live, const Order& order, const std::function<void()>& between,
                 const std::stop_token& stop);
  [[nodiscard]] OrderResult examine(client::Encoder& live, const std::stop_token& stop);
  void reconnect(client::Encoder& live);
  void refuse_order(const std::string& why);
  void accept_orders(bool on);
  [[nodiscard]] State state_now(Time age) const;
  void add_event(std::string_view kind, std::string text, std::string who = {});

  std::string name_;
  client::EncoderAddress address_;
  double rate_;
  Time offset_;
  ServerEvents* server_events_;

  mutable std::mutex mutex_;  // mutex that guards the members from here to `outboxes_`
  std::condition_variable_any changed_;
  Snapshot current_;
  Details details_;
  Time current_since_{};  // time of the last reading; before the first reading, time of the start
  std::optional<Order> order_;
  bool has_ended_ = false;     // whether the thread has ended and accepts no more orders
  bool is_examining_ = false;  // whether an examination runs; no orders are accepted meanwhile
  TimeSeries series_;
  std::array<Outbox, 2> outboxes_;  // queues of readings for other systems, by Outlet

  // The members from here to `thread_` are used by the reading thread only.
  Time next_summary_{};
  Time next_failure_report_{};  // time from which the next event about a failed reading may be recorded
  std::uint32_t alarms_ = 0;
  bool restarted_ = false;
  bool command_runs_ = false;  // whether a command runs that must not be interrupted

  std::jthread thread_;  // the last member: when the thread starts, all members that it uses exist
};

}  // namespace absenc::serve
