// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/memory_change.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <optional>

#include "absenc/client/memory/encoder_memory.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/encoder_text.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/output.hpp"
#include "tools/absenc/progress.hpp"
#include "tools/absenc/run.hpp"

namespace absenc::tool {

namespace {

// Longer than an encoder is busy with a byte and its reply is under way.
constexpr Time settling = std::chrono::milliseconds(50);

std::string_view noun(std::size_t bytes) { return bytes == 1 ? "byte" : "bytes"; }

Json addresses_json(const MemoryImage& image) {
  Json list = Json::array();
  for (const MemoryRun& run : runs(image)) {
    list.append(
        Json::object().set("page", run.first.page).set("address", run.first.address).set("count", run.bytes.size()));
  }
  return list;
}

// The least that one of these bytes bears; "": not known.
std::string write_life(const Unit& unit, const MemoryImage& image) {
  const MemoryArea* least = nullptr;
  for (const auto& [at, value] : image) {
    for (const MemoryArea& area : unit.memory) {
      if (!area.has(at.page, at.address) || area.write_life == 0) continue;
      if (least == nullptr || area.write_life < least->write_life) least = &area;
    }
  }
  return least == nullptr ? "" : life_of(*least);
}

class Change {
 public:
  Change(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted, Access access)
      : invocation_(invocation), uri_(uri), unit_(*uri.unit), wanted_(wanted), access_(access) {}

  int run() {
    const bool dry = invocation_.has("--dry-run");
    asks_ = !dry && must_ask(invocation_, uri_, "writing memory", "bytes that differ are overwritten");
    encoder_ = open_connection(uri_);
    memory_.emplace(*encoder_);
    try {
      memory_->check_model();
      found_ = read_memory(*memory_, wanted_);
      left_ = differing(wanted_, found_);
      differing_ = left_;
      show();
      if (left_.empty() || dry) return finish();
      if (asks_ && !confirmed(uri_, cost())) {
        print_message("nothing was changed");
        return exit_failed;
      }
      write();
      verify();
      return finish();
    } catch (...) {
      return give_account(std::current_exception());
    }
  }

 private:
  [[nodiscard]] bool json() const { return invocation_.has("--json"); }

  [[nodiscard]] std::string cost() const {
    const std::size_t count = differing_.size();
    const std::string life = write_life(unit_, differing_);
    const std::string wear = life.empty() ? "" : fmt::format("; each byte takes one of {}", life);
    return fmt::format("{} of {} {} differ{}{}", count, wanted_.size(), noun(wanted_.size()), count == 1 ? "s" : "",
                       wear);
  }

  void show() const {
    if (json()) return;
    if (differing_.empty()) {
      print_line(wanted_.size() == 1 ? "the byte is so already: nothing to write"
                                     : fmt::format("all {} bytes are so already: nothing to write", wanted_.size()));
      return;
    }
    print_line(difference_table(unit_, "NEW", differing_, found_));
    if (!asks_) print_note(cost());  // otherwise the question says it
  }

  void write() {
    Progress progress;
    const std::size_t all = left_.size();
    while (!left_.empty()) {
      const auto [at, value] = *left_.begin();
      in_flight_ = at;
      memory_->write(at, value, access_);
      in_flight_.reset();
      done_[at] = value;
      left_.erase(at);
      progress.show(fmt::format("writing {} of {} bytes", done_.size(), all));
    }
  }

  // Each byte was read back when it was written; this finds one that a later one has changed.
  void verify() {
    const MemoryImage wrong = differing(done_, read_memory(*memory_, done_));
    if (wrong.empty()) return;
    for (const auto& [at, value] : wrong) {
      done_.erase(at);
      left_[at] = value;
    }
    throw Failure("bytes that were written and read back have changed again");
  }

  int finish() const {
    if (json()) {
      print_line(Json::object()
                     .set("ok", true)
                     .set("compared", wanted_.size())
                     .set("differences", differences_json(differing_, found_))
                     .set("written", addresses_json(done_))
                     .line());
    } else if (!done_.empty()) {
      print_line(fmt::format("{} {} written and read back", done_.size(), noun(done_.size())));
    }
    return exit_good;
  }

  // The byte whose write was cut short: is it there? When the encoder does not say, it stays in flight.
  void settle() {
    if (!in_flight_) return;
    const MemoryAddress at = *in_flight_;
    const std::uint8_t value = left_.at(at);
    try {
      os::sleep_until(os::now() + settling);
      const bool there = memory_->read({{at, 0}}).at(at) == value;
      in_flight_.reset();
      if (!there) return;
      done_[at] = value;
      left_.erase(at);
    } catch (const std::exception&) {
    } catch (const os::Interrupted&) {
    }
  }

  int give_account(const std::exception_ptr& cause) {
    std::string words;
    Json answer = Json::object().set("ok", false);
    try {
      std::rethrow_exception(cause);
    } catch (const os::Interrupted&) {
      words = "interrupted";
      answer.set("message", words);
    } catch (const OutputClosed&) {  // nobody has seen what would be written
      words = "nobody reads standard output";
    } catch (const EncoderFailure& failure) {
      words = failure.what();
      answer = to_json(failure.trouble);
    } catch (const std::exception& error) {
      words = error.what();
      answer.set("message", words);
    }
    print_message(words);
    settle();
    MemoryImage unknown;
    if (in_flight_) unknown.insert(left_.extract(*in_flight_));
    if (json()) {
      answer.set("written", addresses_json(done_)).set("not_written", addresses_json(left_));
      print_line(answer.set("unknown", addresses_json(unknown)).line());
      return exit_failed;
    }
    if (done_.empty() && unknown.empty()) print_note("  nothing was written");
    const auto list = [&](std::string_view what, const MemoryImage& image) {
      if (!image.empty()) print_note(fmt::format("  {}: {}", what, addresses_in_words(unit_, image)));
    };
    list("written and read back", done_);
    list("not known whether written", unknown);
    list("not written", left_);
    if (!left_.empty() || !unknown.empty()) print_note("  The same command again writes only what still differs.");
    return exit_failed;
  }

  const Invocation& invocation_;
  const EncoderAddress& uri_;
  const Unit& unit_;
  const MemoryImage& wanted_;
  Access access_;
  bool asks_ = false;
  std::unique_ptr<Connection> encoder_;
  std::optional<EncoderMemory> memory_;
  MemoryImage found_;
  MemoryImage differing_;
  MemoryImage done_;
  MemoryImage left_;
  std::optional<MemoryAddress> in_flight_;
};

}  // namespace

int change_memory(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted, Access access) {
  return Change(invocation, uri, wanted, access).run();
}

MemoryImage read_memory(EncoderMemory& memory, const MemoryImage& image) {
  Progress progress;
  return memory.read(image, [&](std::size_t done, std::size_t all) {
    progress.show(fmt::format("reading {} of {} bytes", done, all));
  });
}

std::string difference_table(const Unit& unit, std::string_view wanted_name, const MemoryImage& differing,
                             const MemoryImage& found) {
  constexpr std::size_t bytes_in_row = 8;
  std::vector<std::vector<std::string>> rows{{"WHERE", "ENCODER", std::string(wanted_name)}};
  for (const MemoryRun& run : runs(differing, bytes_in_row)) {
    std::vector<std::uint8_t> there;
    MemoryAddress at = run.first;
    for (std::size_t i = 0; i < run.bytes.size(); ++i, ++at.address) there.push_back(found.at(at));
    rows.push_back({to_text(unit, run.first), to_hex(there), to_hex(run.bytes)});
  }
  return table(rows);
}

Json differences_json(const MemoryImage& differing, const MemoryImage& found) {
  Json list = Json::array();
  for (const auto& [at, value] : differing) {
    list.append(Json::object()
                    .set("page", at.page)
                    .set("address", at.address)
                    .set("encoder", found.at(at))
                    .set("wanted", value));
  }
  return list;
}

}  // namespace absenc::tool
