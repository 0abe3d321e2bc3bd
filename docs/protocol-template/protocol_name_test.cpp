// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace absenc::protocol_name {
namespace {

// The kit (tests/kit) tests the behaviour that all units share; add tests here for the contents of this document.
// Remove this test when it passes.
TEST(ProtocolName, HasNoTextOfTheInventedEncoder) {
  const char* const sources = std::getenv("ABSENC_SOURCE_DIR");
  ASSERT_NE(sources, nullptr) << "ABSENC_SOURCE_DIR names no sources: run ./dev unit protocol_name";
  const std::string folder = std::string(sources) + "/absenc/protocol/protocol_name";
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const std::string name = file.path().filename().string();
    if (name == "protocol_name_test.cpp") continue;
    std::ifstream stream(file.path());
    const std::string text(std::istreambuf_iterator<char>(stream), {});
    for (const char* const invented :
         {"invented", "maker and protocol", "maker and encoder", "Maker and encoder", "title of the document",
          "One sentence: which wire", "Draw request and reply", "what the checks cannot see", "Each with its waits",
          "Which rules of its host"}) {
      if (text.find(invented) == std::string::npos) continue;
      ADD_FAILURE() << name << " still has \"" << invented
                    << "\": replace what the template invents by that of your document";
    }
  }
}

}  // namespace
}  // namespace absenc::protocol_name
