// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/version.hpp"

#include <string>

namespace absenc::tool {

std::string_view build_text() { return ABSENC_VERSION ", commit " ABSENC_COMMIT; }

std::string_view architecture() { return ABSENC_ARCHITECTURE; }

std::string version_text() {
  return "absenc " ABSENC_VERSION "\ncommit " ABSENC_COMMIT "\nfor " ABSENC_ARCHITECTURE "\nbuilt in: " ABSENC_BUILT_IN;
}

}  // namespace absenc::tool
