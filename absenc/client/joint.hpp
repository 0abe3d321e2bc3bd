// SPDX-License-Identifier: Apache-2.0
// How an encoder sits in a drive, and the angles of joint and motor that follow from its position.
#pragma once

#include <optional>

#include "absenc/client/estimate.hpp"
#include "absenc/core/angle.hpp"

namespace absenc::client {

/// Settings behind ? and in absenc.toml. What an encoder reports is never replaced: the angles stand beside it.
///
///   joint_deg      = direction * (position_deg - offset_deg) / gear
///   electrical_deg = direction * (angle_deg - offset_deg) * pole_pairs  modulo 360, from 0 to below 360
///
/// `position_deg` are degrees of the encoder's shaft that go on past the end of a turn, `angle_deg` those within the
/// turn. Linear encoders: position_mm and offset_mm are millimetres.
///
///   joint_mm       = direction * (position_mm - offset_mm)
///   electrical_deg = direction * (position_mm - offset_mm) / pole_pair_mm * 360  modulo 360
struct Joint {
  int direction = 1;        ///< 1, or -1: the joint turns against the encoder
  double offset = 0;        ///< degrees at the encoder where the joint is at 0; of linear encoders mm
  double gear = 1;          ///< turns of the encoder for one of the joint, above 0; rotary encoders only
  int pole_pairs = 0;       ///< of the motor on the encoder's shaft; 0: not set; rotary encoders only
  double pole_pair_mm = 0;  ///< length of a pole pair of a linear motor; 0: not set; linear encoders only
  bool is_set = false;      ///< direction, offset or gear: there is a joint to show

  /// Returns whether the encoder of the motor is configured.
  [[nodiscard]] bool has_motor() const { return pole_pairs != 0 || pole_pair_mm > 0; }
};

/// Angles of joint and motor from one reading. A member is empty if it was not set, does not hold or is not known.
struct JointAngles {
  /// Empty too where the encoder has not reported in which turn it is, unless `gear` is 1: then the angle is right up
  /// to whole turns.
  std::optional<double> joint_deg{};
  std::optional<double> joint_mm{};  ///< of linear encoders
  /// Speed of a rotary joint in revolutions per minute; without a value if it is not known.
  std::optional<Estimate> joint_speed_rpm{};
  std::optional<Estimate> joint_speed_mm_s{};  ///< Speed of a linear joint in mm/s; without a value if it is not known.
  std::optional<double> electrical_deg{};      ///< 0 to below 360
};

/// Degrees of the joint. `position_deg`: of the encoder, past the end of a turn.
[[nodiscard]] double joint_degrees(const Joint& joint, double position_deg);
/// Millimetres of the carriage.
[[nodiscard]] double joint_millimetres(const Joint& joint, double position_mm);
/// The electrical angle, 0 to below 360. `position`: degrees within the turn, of linear encoders mm.
[[nodiscard]] double electrical_degrees(const Joint& joint, double position);
/// The speed of the joint, in the unit of `speed`.
[[nodiscard]] Estimate joint_speed(const Joint& joint, const Estimate& speed);

}  // namespace absenc::client
