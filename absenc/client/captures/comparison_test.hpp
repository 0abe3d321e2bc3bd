// SPDX-License-Identifier: Apache-2.0
// Compares results of live commands with the rows of a capture of the same conversation.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absenc/client/captures/stage_test.hpp"
#include "absenc/client/row.hpp"
#include "absenc/core/angle.hpp"
#include "absenc/core/result.hpp"

namespace absenc::client {

inline std::string to_text(const Reading& reading) {
  std::string text = "singleturn=" + std::to_string(reading.singleturn) + "/" +
                     std::to_string(reading.singleturn_bits) +
                     " valid_bits=" + std::to_string(reading.singleturn_valid_bits) +
                     " multiturn=" + std::to_string(reading.multiturn) + "/" + std::to_string(reading.multiturn_bits);
  text += std::string(" multiturn_valid=") + (reading.multiturn_valid ? "1" : "0");
  text += std::string(" known=") + (reading.singleturn_known ? "1" : "0") + (reading.multiturn_known ? "1" : "0");
  text += std::string(" ready=") + (reading.ready ? "1" : "0");
  text += " status=" + std::to_string(reading.status) + " of " + std::to_string(reading.status_reported);
  text += " alarms=" + std::to_string(reading.alarms) + " of " + std::to_string(reading.alarms_reported);
  return text;
}

inline std::string to_text(const Said& said) {
  std::string text = said.what + " [" + std::to_string(said.begin.count()) + ".." + std::to_string(said.end.count()) +
                     "] " + std::string(text_of(said.error).name) + " (" + said.words + ")";
  for (std::size_t i = 0; i < said.answer.columns.size(); ++i) {
    text += " " + std::string(said.answer.columns[i].name) + "=" + client::to_text(said.answer.values[i]);
  }
  if (said.reading) text += "\n      " + to_text(*said.reading);
  return text;
}

/// Compares the result of one live command with the rows that the capture has for the same time.
class Comparison {
 public:
  Comparison(const Unit& unit, const LineSettings& line, bool faulty, const std::vector<Said>& rows)
      : unit_(unit), rows_(rows), faulty_(faulty) {
    // A live CAN receiver waits until the bus is idle, so its times may be later than those of the capture by that
    // wait.
    tolerance_ = unit.link == LinkKind::can ? line.bits(160) : 2 * line.character();
  }

  /// Returns a sentence about the first difference between result and rows; "" if they match.
  std::string operator()(const Said& live) {
    within_.clear();
    for (const Said& row : rows_) {
      if (row.end >= live.begin && row.begin < live.end + tolerance_ && row.words != "cut") within_.push_back(&row);
    }
    const std::string why = live.error == Error::none ? compare_good(live) : compare_bad(live);
    if (why.empty()) return {};
    std::string text = why + "\n  live: " + to_text(live);
    constexpr std::size_t most_shown = 8;
    for (std::size_t i = within_.size() - std::min(most_shown, within_.size()); i < within_.size(); ++i) {
      text += "\n  row:  " + to_text(*within_[i]);
    }
    return text;
  }

 private:
  std::string compare_bad(const Said& live) const {
    const bool told = std::any_of(within_.begin(), within_.end(), [&](const Said* row) {
      return live.is_verdict ? row->error == Error::none : row->error == live.error;
    });
    if (told) return {};
    const bool any =
        std::any_of(within_.begin(), within_.end(), [](const Said* row) { return row->error != Error::none; });
    // A host that has repeated a request may reject a reply that can belong to the earlier request, although the
    // capture shows the reply as good.
    return (any || faulty_) && live.exchanges != 1 ? "" : "no row has the error";
  }

  std::string compare_good(const Said& live) const {
    for (const Said* row : within_) {
      // A search or wake-up command may send requests to which no encoder replies; the rows of these requests have an
      // error.
      const bool silent = row->error == Error::timeout || row->error == Error::line_stuck;
      const bool is_silence = silent && live.exchanges > 1;
      if (row->error != Error::none && !is_silence && !faulty_ && !live.is_special) return "a row has an error";
    }
    if (live.reading) {
      if (std::string why = compare_position(live); !why.empty()) return why;
    }
    std::map<std::string, std::vector<std::string>> told;
    for (const Said* row : within_) {
      if (live.exchanges == 0 && live.reading && !is_of(*row, *live.reading)) continue;
      for (std::size_t i = 0; i < row->answer.columns.size(); ++i) {
        told[std::string(row->answer.columns[i].name)].push_back(client::to_text(row->answer.values[i]));
      }
    }
    for (std::size_t i = 0; i < live.answer.columns.size(); ++i) {
      const std::string name(live.answer.columns[i].name);
      const auto found = told.find(name);
      if (found == told.end() && live.reads && live.exchanges != 0) return "no row has " + name;
      if (found != told.end() && !agree(name, found->second, client::to_text(live.answer.values[i]))) {
        return "another " + name + ": " + found->second.back();
      }
    }
    return {};
  }

  // The last row of a conversation has the final value of each field. A field with Role::exchange has another value in
  // each exchange of the conversation, so any row may have the expected value.
  [[nodiscard]] bool agree(std::string_view name, const std::vector<std::string>& of_rows,
                           const std::string& live) const {
    const bool is_of_exchange = std::any_of(unit_.fields.begin(), unit_.fields.end(), [&](const FieldInfo& field) {
      return field.name == name && field.role == Role::exchange;
    });
    if (!is_of_exchange) return of_rows.back() == live;
    return std::find(of_rows.begin(), of_rows.end(), live) != of_rows.end();
  }

  [[nodiscard]] bool is_of(const Said& row, const Reading& reading) const {
    return row.end > reading.received - tolerance_ && row.end < reading.received + tolerance_;
  }

  // Compares the position of the live reading with that of the last good row that has a position; returns "" if both
  // match.
  std::string compare_position(const Said& live) const {
    const Said* row = nullptr;
    for (const Said* one : within_) {
      const bool fits = live.exchanges != 0 || is_of(*one, *live.reading);
      if (one->reading && one->error == Error::none && fits) row = one;
    }
    // Before the first good frame of a stream, rows of the capture may have no position.
    const bool knows_size = std::any_of(
        rows_.begin(), rows_.end(), [&](const Said& one) { return one.reading && one.end < live.reading->received; });
    if (row == nullptr) return live.exchanges != 0 || knows_size ? "no row has a position" : "";
    Reading all = *row->reading;
    for (const Said* one : within_) {
      if (!one->reading) continue;
      if (all.multiturn_bits == 0 && live.reading->multiturn_bits != 0 && one->reading->singleturn_bits == 0) {
        all.multiturn = one->reading->multiturn;
        all.multiturn_bits = one->reading->multiturn_bits;
        all.multiturn_valid = one->reading->multiturn_valid;
      }
    }
    Reading known = *live.reading;
    // A command that only this unit has may leave out turns that its reply carries; for example, a safe position is
    // reported without turns.
    if (live.is_special && known.multiturn_bits == 0) {
      all.multiturn = known.multiturn;
      all.multiturn_bits = known.multiturn_bits;
      all.multiturn_valid = known.multiturn_valid;
    }
    // Rows of a capture also contain alarms that earlier conversations reported; a host that reads once does not know
    // these.
    all.alarms &= known.alarms_reported;
    all.alarms_reported &= known.alarms_reported;
    all.status &= known.status_reported;
    all.status_reported &= known.status_reported;
    if (!known.singleturn_known) {
      all.singleturn_known = false;
      all.singleturn_valid_bits = known.singleturn_valid_bits;
    }
    if (!known.multiturn_known) {
      all.multiturn_known = false;
      all.multiturn_valid = known.multiturn_valid;
    }
    return to_text(known) == to_text(all) ? "" : "another position: " + to_text(all);
  }

  const Unit& unit_;
  const std::vector<Said>& rows_;
  bool faulty_;
  Time tolerance_{};
  std::vector<const Said*> within_;
};

}  // namespace absenc::client
