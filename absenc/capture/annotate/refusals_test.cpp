// SPDX-License-Identifier: Apache-2.0
// Tests that a refusal, here an exception of Modbus RTU, is the reply to its request.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "absenc/capture/annotate/annotate.hpp"
#include "absenc/capture/annotate/annotated_bytes_test.hpp"
#include "absenc/capture/annotate/conversation_test.hpp"
#include "absenc/protocol/all.hpp"

namespace absenc::capture {
namespace {

using Wire = std::vector<std::uint8_t>;

const Wire request{0x01, 0x03, 0x00, 0x00, 0x00, 0x01, 0x84, 0x0A};
const Wire reply{0x01, 0x03, 0x02, 0x01, 0x7F, 0xF8, 0x34};
const Wire refusal{0x01, 0x83, 0x02, 0xC0, 0xF1};

Wire joined(const Wire& first, const Wire& second) {
  Wire both = first;
  both.insert(both.end(), second.begin(), second.end());
  return both;
}

/// Checks that the bytes in `runs`, each followed by a pause, are annotated as one request that the encoder refused.
/// They are sent between two good exchanges.
void expect_refusal(const std::vector<Wire>& runs, Remark remark) {
  std::vector<Wire> all{request, reply};
  all.insert(all.end(), runs.begin(), runs.end());
  all.insert(all.end(), {request, reply});
  constexpr Tick length = 100;  // duration of a character in ticks
  Annotator::Settings settings;
  settings.begins_silent = true;
  settings.ticks = {.pause = length, .character = length};
  testing::BytesCollector collector;
  Annotator annotator(*find_unit("raa38-modbus"), testing::options_of(*find_unit("raa38-modbus"), {{"bits", "14"}}),
                      settings, collector);
  Tick now = 0;
  for (const Wire& run : all) {
    for (const std::uint8_t byte : run) {
      annotator.put({.begin = now, .end = now + length, .value = byte});
      now += length;
    }
    now += 5 * length;
  }
  annotator.finish(now);
  const std::vector<testing::AnnotatedBytes>& found = collector.found;
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].error, Error::none);
  EXPECT_EQ(found[1].kind, Annotation::Kind::exchange);
  EXPECT_EQ(found[1].error, Error::request_rejected);
  EXPECT_EQ(found[1].remark, remark);
  EXPECT_EQ(found[1].request, request);
  EXPECT_EQ(found[1].reply, refusal);
  EXPECT_EQ(found[2].error, Error::none);
}

TEST(Refusals, AnswerRequestAfterPause) { expect_refusal({request, refusal}, Remark::none); }
TEST(Refusals, AnswerRequestWithoutPause) { expect_refusal({joined(request, refusal)}, Remark::none); }
TEST(Refusals, AnswerRequestBehindEcho) { expect_refusal({request, joined(request, refusal)}, Remark::echo); }

}  // namespace
}  // namespace absenc::capture
