// SPDX-License-Identifier: Apache-2.0
// Virtual encoders on the pins of an MPSSE, edge by edge, and faults of their line.
#pragma once

#include <iosfwd>
#include <optional>
#include <vector>

#include "absenc/link/step.hpp"
#include "tests/ftdi/mpsse.hpp"

namespace absenc::ftdi {

/// A clocked encoder behind an RS-422 transceiver: clock from ADBUS0, data to ADBUS2; on a bidirectional line data from
/// ADBUS1 while ADBUS4 is high.
class EncoderWires final : public Wires {
 public:
  static constexpr std::uint8_t direction = 0x10;

  /// `device` must outlive this object. `kind`: clocked or clocked_bidirectional.
  EncoderWires(LinkKind kind, const LineSettings& settings, Machine<std::uint8_t>& device);

  void change(Time at, std::uint8_t levels, std::uint8_t outputs) override;
  [[nodiscard]] bool data(Time at) override;

  /// Ends a word that the host no longer clocks, and wakes the device; for callers that let time pass.
  void pass(Time now);

  /// The line between encoder and chip.
  struct Fault {
    Time delay{};                  // of clock and data together
    std::optional<bool> stuck{};   // the data line stays at this level
    bool no_transceiver = false;   // nothing drives the data pin
    bool no_clock = false;         // the clock does not reach the encoder
    bool clock_swapped = false;    // the wires of the clock pair are exchanged
    std::uint32_t flip_every = 0;  // every so manieth sampled bit is wrong; 0: none
  };
  Fault fault;

  /// Starts to keep all changes, for `write_vcd`.
  void record() { records_ = true; }
  /// Writes the clock at the chip's pin, the data of host and encoder on their pair, and the direction, as a value
  /// change dump in steps of a nanosecond.
  void write_vcd(std::ostream& file) const;

 private:
  struct Change {
    Time at;
    bool level;
  };

  void falls(Time at);
  void rises(Time at);
  void select(Time at, Time period);
  void deselect(Time at);
  void turn(Time at);
  void feed(const ByteEvent& event);
  void run(Time now);
  void set_level(Time at);
  [[nodiscard]] bool level_after_edges() const;

  LinkKind kind_;
  LineSettings settings_;
  Machine<std::uint8_t>* device_;
  Time timer_ = never;

  bool clock_ = true, out_ = false, drives_ = false;  // levels of the host's wires
  Time last_edge_ = Time::min(), fell_at_{}, half_{};
  bool selected_ = false, held_low_ = false;
  std::size_t clocks_ = 0;       // rising edges since the encoder was selected
  std::size_t driven_from_ = 0;  // bidirectional: the clock after which the first bit of `driven_` is on the line
  std::vector<std::uint8_t> driven_;
  bool behind_driven_ = true;
  Time width_{};
  std::vector<bool> host_bits_;
  std::size_t host_from_ = 0;

  std::vector<Change> levels_{{Time::min(), true}};  // data at the encoder
  std::uint32_t sampled_ = 0;
  std::uint8_t left_ = 0;  // level at which the chip left the data pin, and whether it has
  Time left_at_ = Time::min();
  bool was_output_ = false;

  bool records_ = false;
  std::vector<Change> recorded_clock_, recorded_direction_, recorded_out_;
};

}  // namespace absenc::ftdi
