// SPDX-License-Identifier: Apache-2.0
// Conversation that reads a position a second time if the first reply does not prove that the position is right.
#pragma once

#include <optional>

#include "absenc/protocol/author/dialog.hpp"

namespace absenc::author {

/// Conversation that reads a position, and requests a second reply if the first one does not prove it. The protocol
/// needs these functions besides those of dialog.hpp:
///
///   static bool needs_another(const Format&, const Reply&);   // whether this first reply proves nothing alone
///   static Error agree(const Format&, const Reply& first, const Reply& second, Time between);
template <class P>
class ReadConfirmed : public HostOf<P> {
 public:
  /// Constructs a conversation that reads an encoder of this format by the request `request`.
  ReadConfirmed(const typename P::Format& format, const typename P::Request& request) : HostOf<P>(format) {
    this->ask(request);
  }
  [[nodiscard]] const Reading* reading() const final {
    // the result is `reading_`, which is set only if no error occurred
    return reading_.singleturn_bits != 0 ? &reading_ : nullptr;
  }

 private:
  void concluded(Error error) final {
    if (error == Error::none && first_) {
      error = P::agree(this->format(), *first_, this->last(), this->received_at() - first_at_);
    } else if (error == Error::none && P::needs_another(this->format(), this->last())) {
      first_ = this->last();
      first_at_ = this->sent_at();
      return this->ask(this->request());
    }
    if (error == Error::none) new (&reading_) Reading(this->last_reading());
    this->finish(error, error == Error::none ? Time{} : this->manner().hold);
  }

  std::optional<typename P::Reply> first_;
  Time first_at_{};
  Reading reading_{};
};

}  // namespace absenc::author
