// SPDX-License-Identifier: Apache-2.0
// Faults of adapters and of other encoders, for tests of doctor.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absenc/client/doctor/path_faults_test.hpp"

namespace absenc::client {

struct Fault {
  std::string id;
  std::function<Examination()> examine;
};

inline std::vector<Fault> adapter_faults() {
  std::vector<Fault> faults;
  std::vector<path_faults::PathFault> all = path_faults::faults_of_bytes();
  for (const path_faults::PathFault& one : path_faults::faults_of_others()) {
    if (one.name == "another protocol" || one.name == "another address") all.push_back(one);
  }
  for (const path_faults::PathFault& one : all) {
    for (const Unit* unit : path_faults::character_units()) {
      const std::optional<path_faults::Outcome> outcome =
          one.examine(*unit, path_faults::asked_mode(*unit), path_faults::rates_of(*unit).front());
      if (!outcome) continue;
      const bool is_named = outcome->causes.contains(one.name);
      faults.push_back(
          {is_named ? one.name : *outcome->causes.begin(), [seen = outcome->seen.examination] { return seen; }});
      break;
    }
  }
  return faults;
}

}  // namespace absenc::client
