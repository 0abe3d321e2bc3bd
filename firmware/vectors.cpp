// SPDX-License-Identifier: Apache-2.0
// Decodes every vector of every unit on the machine and compares fields and errors.
#include <algorithm>
#include <array>

#include "absenc/protocol/all.hpp"
#include "absenc/protocol/vector_check.hpp"
#include "firmware/machine/machine.hpp"
#include "firmware/vectors.hpp"

namespace absenc::firmware {
namespace {

using machine::print;

// Removes the text before the first `end` from `text` and returns it. It does not use substr(), which may throw.
std::string_view cut(std::string_view& text, char end) {
  const std::size_t size = std::min(text.find(end), text.size());
  const std::string_view front(text.data(), size);
  text.remove_prefix(std::min(size + 1, text.size()));
  return front;
}

bool resolve(const Unit& unit, std::string_view text, Options& options) {
  Buffer<OptionText, maximum_options> settings;
  while (!text.empty()) {
    std::string_view value = cut(text, ' ');
    const std::string_view name = cut(value, '=');
    if (!settings.push_back({name, value})) return false;
  }
  return resolve_options(unit, {}, settings, options).kind == OptionError::Kind::none;
}

// Compares decoded fields with the fields that a reference vector of tests/*.json expects.
class ReferenceCheck final : public FieldSink {
 public:
  explicit ReferenceCheck(std::span<const ExpectedField> expected) : expected_(expected) {}

  void put(const FieldValue& value) override {
    for (const ExpectedField& one : expected_) {
      if (one.field != value.info->name) continue;
      ++matches_;
      if (!matches(one, value)) wrong_ = true;
    }
  }
  // Returns whether all expected fields were decoded; those expected as "" may be missing.
  [[nodiscard]] bool all() const {
    const auto needed = std::count_if(expected_.begin(), expected_.end(), [](const ExpectedField& one) {
      return one.kind != ExpectedField::Kind::text || !one.text.empty();
    });
    return !wrong_ && matches_ >= static_cast<std::size_t>(needed);
  }

 private:
  static bool matches(const ExpectedField& one, const FieldValue& value) {
    using Kind = FieldInfo::Kind;
    switch (value.info->kind) {
      case Kind::flags:
        return one.kind == ExpectedField::Kind::names && one.text == names(value);
      case Kind::real: {
        const double difference = one.real - value.real;
        return one.kind != ExpectedField::Kind::names && difference < 1e-6 && difference > -1e-6;
      }
      case Kind::text:
        return VectorCheck::same(one.text, value.bytes);
      case Kind::bytes:
        return hexadecimal(value.bytes) == one.text;
      default:
        return one.kind == ExpectedField::Kind::number && one.number == value.number;
    }
  }
  using Text = Buffer<char, 192>;
  static void add(Text& text, std::string_view more) {
    for (const char c : more) static_cast<void>(text.push_back(c));
  }
  static std::string_view view(const Text& text) { return {text.view().data(), text.view().size()}; }

  static Text& scratch() {
    static Text text;
    text.clear();
    return text;
  }
  static std::string_view names(const FieldValue& value) {
    Text& text = scratch();
    for (std::size_t bit = 0; bit < value.info->flags.size(); ++bit) {
      if ((value.number >> bit & 1) == 0) continue;
      if (!text.empty()) add(text, " ");
      add(text, value.info->flags[bit].name);
    }
    return view(text);
  }
  static std::string_view hexadecimal(Bytes bytes) {
    Text& text = scratch();
    for (const std::uint8_t byte : bytes) {
      static_cast<void>(text.push_back("0123456789abcdef"[byte >> 4]));
      static_cast<void>(text.push_back("0123456789abcdef"[byte & 15]));
    }
    return view(text);
  }

  std::span<const ExpectedField> expected_;
  std::size_t matches_ = 0;
  bool wrong_ = false;
};

// A frame of a reference vector, which is stored as bytes, or as the text of bits or of a CAN frame.
class VectorFrame {
 public:
  VectorFrame(LinkKind link, Bytes text) : bytes_(text), is_bits_(carries_bits(link)) {
    if (is_bits_) bits_ = bits_of_text(text);
    is_can_ = link == LinkKind::can && !text.empty();
    if (is_can_) can_ = can_frame_of_text(text);
  }
  [[nodiscard]] Frame frame() const {
    if (is_can_) return {.can = &can_};
    if (is_bits_) return {.bytes = bits_.bytes(), .bits = bits_.size()};
    return {.bytes = bytes_};
  }

 private:
  Bytes bytes_;
  BitBuffer<256> bits_;
  CanFrame can_;
  bool is_bits_;
  bool is_can_;
};

struct Count {
  unsigned decoded = 0;
  unsigned wrong = 0;

  template <class Fields>
  void check(const Unit* unit, std::string_view id, std::string_view settings, Bytes request, Bytes reply, Error error,
             Fields& fields) {
    ++decoded;
    Options options;
    if (unit == nullptr || !resolve(*unit, settings, options)) return report(id, "has no unit or other options");
    const VectorFrame request_frame(unit->link, request);
    const VectorFrame reply_frame(unit->link, reply);
    const Error found = unit->decode(options, request_frame.frame(), reply_frame.frame(), fields);
    if (found != error) return report(id, text_of(found).name);
    if (!fields.all()) report(id, "decodes to other fields");
  }
  void report(std::string_view id, std::string_view what) {
    ++wrong;
    print(id);
    print(": ");
    print(what);
    print("\n");
  }
};

}  // namespace
}  // namespace absenc::firmware

int main() {
  using namespace absenc;
  using namespace absenc::firmware;
  Count count;
  for (const Unit* const unit : all_units()) {
    for (const Vector& one : unit->vectors) {
      VectorCheck fields(one.fields);
      count.check(unit, one.id, one.options, one.request, one.reply, one.error, fields);
    }
  }
  for (const ReferenceVector& one : reference_vectors()) {
    ReferenceCheck fields(one.fields);
    count.check(find_unit(one.unit), one.id, one.options, one.request, one.reply, one.error, fields);
  }
  print("decoded ");
  print(count.decoded);
  print(", wrong ");
  print(count.wrong);
  print(", stack ");
  print(machine::stack_used());
  print("\n");
  machine::end(count.wrong == 0);
}
