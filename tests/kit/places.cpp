// SPDX-License-Identifier: Apache-2.0
// Checks the bit positions that a unit states for the fields of its replies.
#include <algorithm>
#include <set>

#include "absenc/sim/place.hpp"
#include "tests/kit/kit.hpp"
#include "tests/kit/world.hpp"

namespace absenc::kit {
namespace {

bool bit_of(const OwnedFrame& frame, std::size_t bit) {
  const std::span<const std::uint8_t> bytes = frame.can ? frame.can->bytes() : Bytes(frame.bytes);
  return (bytes[bit / 8] & (carries_bits(frame.link) ? 0x80u >> bit % 8 : 1u << bit % 8)) != 0;
}

/// Returns the value of the bits in `ranges`, at most 64, and sets `width` to their number.
std::uint64_t bits_at(const OwnedFrame& frame, const BitRanges& ranges, unsigned& width) {
  std::uint64_t value = 0;
  width = 0;
  for (const BitRange& range : ranges.view()) {
    for (std::size_t i = 0; i < range.count && width < 64; ++i, ++width) {
      const std::size_t bit = range.first + (carries_bits(frame.link) ? range.count - 1 - i : i);
      if (bit_of(frame, bit) != range.inverted) value |= std::uint64_t{1} << width;
    }
  }
  return value;
}

/// Checks, frame by frame, the bit positions that a unit states for the fields of each frame.
class Places final : public FieldSink {
 public:
  Places(const Unit& unit, Findings& findings) : unit_(unit), findings_(findings) {}

  /// Checks the bit positions of the fields of a reply. Returns whether the reply is valid.
  bool check_frame(const Options& options, const OwnedFrame& request, const OwnedFrame& reply) {
    if (unit_.check(options, request.frame(), reply.frame()) != Error::none) return false;
    options_ = &options;
    request_ = &request;
    reply_ = &reply;
    static_cast<void>(unit_.decode(options, request.frame(), reply.frame(), *this));
    return true;
  }

  void put(const FieldValue& value) override {
    const FieldInfo& info = *value.info;
    const BitRanges ranges = unit_.bits(*options_, request_->frame(), reply_->frame(), info);
    if (ranges.empty()) return;
    const auto require = [&](bool holds, const char* text) {
      findings_.require(holds, [&] { return std::string(info.name) + " of " + to_text(*reply_) + " " + text; });
    };
    const bool inside = std::all_of(ranges.view().begin(), ranges.view().end(), [&](const BitRange& range) {
      return range.count > 0 && range.first + range.count <= reply_->bit_count();
    });
    require(inside, "lies outside the frame");
    const bool is_number =
        info.kind != FieldInfo::Kind::real && info.kind != FieldInfo::Kind::text && info.kind != FieldInfo::Kind::bytes;
    require(is_number, "has bit positions but is no number");
    if (!inside || !is_number) return;
    unsigned width = 0;
    const std::uint64_t bits = bits_at(*reply_, ranges, width);
    require(bits == (static_cast<std::uint64_t>(value.number) & low_mask(width)),
            "has another value at its bit positions");
    const bool fits = value.number < 0 || (static_cast<std::uint64_t>(value.number) & ~low_mask(width)) == 0;
    require(fits, "has more bits");
    placed_.insert(info.role);
  }

  /// Checks that the unit stated the bit positions of the position field for at least one of the frames.
  void require_position() {
    findings_.require(placed_.contains(Role::position), [] { return "no frame has bit positions of the position"; });
  }

 private:
  const Unit& unit_;
  Findings& findings_;
  const Options* options_ = nullptr;
  const OwnedFrame* request_ = nullptr;
  const OwnedFrame* reply_ = nullptr;
  std::set<Role> placed_;
};

// Checks the replies of the test vectors, whole and with one bit flipped, if they are valid.
void check_vectors(const Unit& unit, Places& places) {
  for (const Vector& vector : unit.vectors) {
    const std::optional<Options> options = options_of(unit, vector.options);
    const OwnedFrame request = frame_of(unit, vector.request);
    const OwnedFrame reply = frame_of(unit, vector.reply);
    if (!options || reply.empty() || !places.check_frame(*options, request, reply)) continue;
    for (std::size_t bit = 0; bit < reply.bit_count(); ++bit) places.check_frame(*options, request, reply.flipped(bit));
  }
}

// Checks replies of the virtual encoder at random shaft positions.
void check_exchange_replies(const Unit& unit, Places& places) {
  sim::Random random(11);
  for (const Configuration& configuration : configurations(unit)) {
    World<std::uint8_t> world(unit, configuration.options, 1);
    if (!world.made()) continue;
    for (const Command& command : unit.commands) {
      for (unsigned i = 0; i < 20 && !command.changes_encoder && command.verb != Verb::scan; ++i) {
        world.move(static_cast<std::int64_t>(random.next()));
        const ConversationResult result = world.run(command, least_arguments(command));
        if (!result.good()) break;
        const OwnedFrame sent{.link = unit.link, .bytes = result.sent};
        places.check_frame(configuration.options, sent, {.link = unit.link, .bytes = result.received});
      }
    }
  }
}

}  // namespace

Findings check_places(const Unit& unit) {
  Findings findings;
  if (unit.bits == nullptr) return findings;
  Places places(unit, findings);
  check_vectors(unit, places);
  if (unit.link != LinkKind::can && unit.link != LinkKind::clocked) check_exchange_replies(unit, places);
  places.require_position();
  return findings;
}

}  // namespace absenc::kit
