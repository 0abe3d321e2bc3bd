// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/verbs/memory_change.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <optional>

#include "absenc/client/memory.hpp"
#include "absenc/client/text/unit_text.hpp"
#include "absenc/client/text/wire_text.hpp"
#include "absenc/os/error.hpp"
#include "absenc/os/signals.hpp"
#include "tools/absenc/consent.hpp"
#include "tools/absenc/error.hpp"
#include "tools/absenc/text/encoder_text.hpp"
#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/progress.hpp"
#include "tools/absenc/verbs/run.hpp"

namespace absenc::tool {

namespace {

Json addresses_json(const MemoryImage& image) {
  return Json::list(runs(image), [](const MemoryRun& run) {
    return Json::object().set("page", run.first.page).set("address", run.first.address).set("count", run.words.size());
  });
}

// Returns in words how many writes the bytes of `image` endure, by the weakest of them; "" if unknown.
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

// Runs `work` and shows its progress; nothing else may be printed meanwhile.
template <class Work>
void with_progress(const Unit& unit, std::string_view doing, const Work& work) {
  Progress progress;
  work([&](std::size_t done, std::size_t all) {
    progress.show(fmt::format("{} {} of {} {}", doing, done, all, word_noun(unit, all)));
  });
}

class MemoryWrite {
 public:
  MemoryWrite(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted, MemoryAccess access)
      : invocation_(invocation), uri_(uri), unit_(*uri.unit), wanted_(wanted), access_(access) {}

  int run() {
    const bool dry = invocation_.has("--dry-run");
    asks_ = !dry && must_ask(invocation_, uri_, "writing memory",
                             fmt::format("{} that differ are overwritten", word_noun(*uri_.unit, 2)));
    encoder_ = before_change([&] { return open_encoder(uri_); });
    change_.emplace(encoder_->memory(), wanted_, access_);
    try {
      with_progress(unit_, "reading", [&](const MemoryProgress& progress) { change_->look(progress); });
      show();
      if (change_->differing().empty() || dry) return finish();
      if (asks_ && !confirmed(uri_, cost())) {
        print_message("nothing was changed");
        return exit_failed;
      }
      with_progress(unit_, "writing", [&](const MemoryProgress& progress) { change_->write(progress); });
      with_progress(unit_, "reading", [&](const MemoryProgress& progress) { change_->verify(progress); });
      return finish();
    } catch (...) {
      return give_account(std::current_exception());
    }
  }

 private:
  [[nodiscard]] bool json() const { return invocation_.has("--json"); }

  [[nodiscard]] std::string cost() const {
    const std::size_t count = change_->differing().size();
    const std::string life = write_life(unit_, change_->differing());
    const std::string wear = life.empty() ? "" : fmt::format("; each {} takes one of {}", word_noun(unit_, 1), life);
    return fmt::format("{} of {} {} differ{}{}", count, wanted_.size(), word_noun(unit_, wanted_.size()),
                       count == 1 ? "s" : "", wear);
  }

  void show() const {
    if (json()) return;
    if (change_->differing().empty()) {
      print_line(wanted_.size() == 1
                     ? fmt::format("the {} is so already: nothing to write", word_noun(unit_, 1))
                     : fmt::format("all {} {} are so already: nothing to write", wanted_.size(), word_noun(unit_, 2)));
      return;
    }
    print_line(difference_table(unit_, "NEW", change_->differing(), change_->found()));
    // the question to the user already contains the number of differing bytes and the wear of the memory
    if (!asks_) print_note(cost());
  }

  int finish() const {
    const MemoryImage& written = change_->written();
    const std::string& note = encoder_->change().note;
    if (!note.empty()) print_message(fmt::format("note: {}", note));
    if (json()) {
      print_line(Json::object()
                     .set("ok", true)
                     .set("compared", wanted_.size())
                     .set("differences", differences_json(change_->differing(), change_->found()))
                     .set("written", addresses_json(written))
                     .set("change", word_of(change_->state()))
                     .line());
    } else if (!written.empty()) {
      print_line(fmt::format("{} {} written and read back", written.size(), word_noun(unit_, written.size())));
    }
    return exit_good;
  }

  int give_account(const std::exception_ptr& cause) {
    std::string words;
    Json answer = Json::object().set("ok", false);
    try {
      std::rethrow_exception(cause);
    } catch (const os::Interrupted&) {
      words = "interrupted";
      answer.set("message", words);
    } catch (const OutputClosed&) {
      // the user may not have seen the list of bytes to be written, or the result
      words = "nobody reads standard output";
    } catch (const EncoderFailure& failure) {
      words = failure.what();
      answer = to_json(failure.trouble);
    } catch (const std::exception& error) {
      words = error.what();
      answer.set("message", words);
    }
    print_message(words);
    change_->settle();
    const MemoryImage& written = change_->written();
    const MemoryImage unknown = change_->unknown();
    const MemoryImage left = change_->not_written();
    if (json()) {
      answer.set("written", addresses_json(written)).set("not_written", addresses_json(left));
      answer.set("unknown", addresses_json(unknown)).set("change", word_of(change_->state()));
      print_line(answer.line());
      return exit_failed;
    }
    if (written.empty() && unknown.empty()) print_note("  nothing was written");
    const auto list = [&](std::string_view what, const MemoryImage& image) {
      if (!image.empty()) print_note(fmt::format("  {}: {}", what, addresses_in_words(unit_, image)));
    };
    list("written and read back", written);
    list("not known whether written", unknown);
    list("not written", left);
    if (!left.empty() || !unknown.empty()) print_note("  The same command again writes only what still differs.");
    return exit_failed;
  }

  const Invocation& invocation_;
  const EncoderAddress& uri_;
  const Unit& unit_;
  const MemoryImage& wanted_;
  MemoryAccess access_;
  bool asks_ = false;
  std::optional<Encoder> encoder_;
  std::optional<MemoryChange> change_;
};

}  // namespace

int change_memory(const Invocation& invocation, const EncoderAddress& uri, const MemoryImage& wanted,
                  MemoryAccess access) {
  return MemoryWrite(invocation, uri, wanted, access).run();
}

MemoryImage read_memory(Memory& memory, const MemoryImage& image) {
  MemoryImage found;
  with_progress(memory.unit(), "reading",
                [&](const MemoryProgress& progress) { found = memory.read(image, progress); });
  return found;
}

std::string difference_table(const Unit& unit, std::string_view wanted_name, const MemoryImage& differing,
                             const MemoryImage& found) {
  const std::size_t words_in_row = 8 / word_bytes(unit);
  std::vector<std::vector<std::string>> rows{{"WHERE", "ENCODER", std::string(wanted_name)}};
  for (const MemoryRun& run : runs(differing, words_in_row)) {
    std::vector<std::uint32_t> there;
    MemoryAddress at = run.first;
    for (std::size_t i = 0; i < run.words.size(); ++i, ++at.address) there.push_back(found.at(at));
    rows.push_back({to_text(unit, run.first), words_in_hex(unit, there), words_in_hex(unit, run.words)});
  }
  return table(rows);
}

Json differences_json(const MemoryImage& differing, const MemoryImage& found) {
  return Json::list(differing, [&](const auto& one) {
    const auto& [at, value] = one;
    return Json::object()
        .set("page", at.page)
        .set("address", at.address)
        .set("encoder", found.at(at))
        .set("wanted", value);
  });
}

}  // namespace absenc::tool
