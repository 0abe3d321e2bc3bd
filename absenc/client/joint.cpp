// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/joint.hpp"

#include <cmath>

namespace absenc::client {

double joint_degrees(const Joint& joint, double position_deg) {
  // an angle of -0.0 plus 0.0 is 0.0, so that no "-0.0" is printed
  return joint.direction * (position_deg - joint.offset) / joint.gear + 0.0;
}

double joint_millimetres(const Joint& joint, double position_mm) {
  return joint.direction * (position_mm - joint.offset) + 0.0;
}

double electrical_degrees(const Joint& joint, double position) {
  const double way = joint.direction * (position - joint.offset);
  const double angle = joint.pole_pair_mm > 0 ? std::remainder(way, joint.pole_pair_mm) / joint.pole_pair_mm * 360
                                              : way * joint.pole_pairs;
  const double within = std::fmod(angle, 360);
  const double positive = within < 0 ? within + 360 : within;
  return positive < 360 ? positive + 0.0 : 0;  // a tiny negative angle plus 360 is rounded to 360, which must become 0
}

Estimate joint_speed(const Joint& joint, const Estimate& speed) {
  return {joint.direction * speed.value / joint.gear + 0.0, speed.uncertainty / joint.gear};
}

}  // namespace absenc::client
