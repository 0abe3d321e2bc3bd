// SPDX-License-Identifier: Apache-2.0
// Checks with a unit whether captured bytes are a frame, and decodes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absenc/capture/annotate/annotation.hpp"
#include "absenc/core/angle.hpp"
#include "absenc/protocol/unit.hpp"

namespace absenc::capture {

class Judge {
 public:
  /// Makes a judge for frames of `unit`, which must outlive it.
  Judge(const Unit& unit, const Options& options)
      : unit_(&unit),
        options_(options),
        storage_(std::make_unique<std::byte[]>(unit.decoder_storage)),
        decoded_(options.has_word()) {
    if (unit.decoder != nullptr) decoder_ = unit.decoder(options, {storage_.get(), unit.decoder_storage});
  }

  [[nodiscard]] const Unit& unit() const { return *unit_; }

  /// Decodes a request and its reply, and returns the error of decoding. Afterwards `contents` returns the decoded
  /// fields and reading, which are empty after an error.
  Error decode(const Frame& request, const Frame& reply) {
    decoded_.clear();
    const Error error = decoder_ != nullptr ? decoder_->decode(request, reply, decoded_)
                                            : unit_->decode(options_, request, reply, decoded_);
    if (error != Error::none) decoded_.clear();
    return error;
  }
  /// Returns the content of the last decoded frame, until `decode` or `request_size` is called.
  [[nodiscard]] Contents contents() const {
    return {decoded_.fields, decoded_.has_reading ? &decoded_.reading : nullptr};
  }

  /// Returns the size of the complete frame, good or not, at the begin of `bytes`; 0 if there is none.
  [[nodiscard]] std::size_t frame_size(Direction direction, Bytes bytes) const {
    const FrameEnd end = unit_->frame_end(options_, direction, bytes);
    return end.kind == FrameEnd::Kind::complete && end.size <= bytes.size() ? end.size : 0;
  }
  /// Returns whether `bytes` are the beginning of a frame that is not yet complete.
  [[nodiscard]] bool is_incomplete(Direction direction, Bytes bytes) const {
    return unit_->frame_end(options_, direction, bytes).kind == FrameEnd::Kind::incomplete;
  }
  /// Returns the size of the complete good request at the begin of `bytes`; 0 if there is none.
  [[nodiscard]] std::size_t request_size(Bytes bytes) {
    const std::size_t size = frame_size(Direction::request, bytes);
    return size != 0 && decode({.bytes = bytes.first(size)}, {}) == Error::none ? size : 0;
  }

  /// Returns the index of the encoder's control bit in a reply, or nothing; see Unit::control_bit.
  [[nodiscard]] std::optional<std::size_t> control_bit(const Frame& reply) const {
    return unit_->control_bit != nullptr ? unit_->control_bit(options_, reply) : std::nullopt;
  }

  /// Returns the ranges of bits of a burst that the host sends; see Unit::host_bits.
  [[nodiscard]] BitRanges host_bits(const Frame& burst) const { return unit_->host_bits(options_, burst); }

  [[nodiscard]] bool is_answered(const Frame& request) const {
    return unit_->is_answered == nullptr || unit_->is_answered(options_, request);
  }
  [[nodiscard]] bool streams() const { return unit_->streams != nullptr && unit_->streams(options_); }

 private:
  struct DecodedFields final : FieldSink {
    explicit DecodedFields(bool has_word) : is_described(has_word) {}

    void clear() {
      fields.clear();
      bytes.clear();
      described.clear();
      has_reading = false;
    }
    void put(const FieldValue& value) override {
      fields.push_back(value);
      if (!value.bytes.empty()) store_bytes();
      if (is_described) store_info();
    }
    void put_reading(const Reading& one) override {
      reading = one;
      has_reading = true;
    }
    // Copies the bytes of a field, which the unit keeps valid only while it calls the sink. Adding to the storage may
    // move earlier copies.
    void store_bytes() {
      const Bytes added = fields.back().bytes;
      bytes.insert(bytes.end(), added.begin(), added.end());
      std::size_t at = 0;
      for (FieldValue& field : fields) {
        field.bytes = Bytes(bytes).subspan(at, field.bytes.size());
        at += field.bytes.size();
      }
    }
    // Copies the description of a field in a word that the user has described; the unit keeps it valid only while it
    // calls the sink.
    void store_info() {
      described.push_back({std::string(fields.back().info->name), *fields.back().info});
      described.back().info.name = described.back().name;
      fields.back().info = &described.back().info;
    }

    struct DescribedField {
      std::string name;
      FieldInfo info;
    };
    bool is_described;  // true: the user has described the word, so the descriptions of its fields must be copied
    std::vector<FieldValue> fields;
    std::vector<std::uint8_t> bytes;
    std::deque<DescribedField> described;
    Reading reading{};
    bool has_reading = false;
  };

  const Unit* unit_;
  Options options_;
  std::unique_ptr<std::byte[]> storage_;  // memory in which the unit constructs its decoder
  FrameDecoder* decoder_ = nullptr;
  DecodedFields decoded_;
};

}  // namespace absenc::capture
