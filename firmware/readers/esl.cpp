// SPDX-License-Identifier: Apache-2.0
#include "absenc/protocol/esl/reply.hpp"
#include "firmware/readers/reader.hpp"

int main() {
  using namespace absenc;
  firmware::run<std::uint8_t, author::ReadPosition<esl::Protocol>>(esl::Profile{}, esl::Request{});
}
