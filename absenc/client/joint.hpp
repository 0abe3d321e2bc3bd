// SPDX-License-Identifier: Apache-2.0
// Angles of joint and motor that follow from the encoder's position.
#pragma once

#include <optional>

#include "absenc/client/estimate.hpp"
#include "absenc/core/angle.hpp"

namespace absenc::client {

/// How an encoder is mounted in its drive: settings of an address or of absenc.toml.
///
///   joint_deg      = direction * (position_deg - offset_deg) / gear
///   electrical_deg = direction * (angle_deg - offset_deg) * pole_pairs  modulo 360, from 0 to below 360
///
/// `position_deg` is the angle of the encoder's shaft, continued past the end of a turn; `angle_deg` is the angle
/// within the turn. For linear encoders:
///
///   joint_mm       = direction * (position_mm - offset_mm)
///   electrical_deg = direction * (position_mm - offset_mm) / pole_pair_mm * 360  modulo 360
struct Joint {
  int direction = 1;   ///< Direction of the joint: 1, or -1 if the joint turns against the encoder.
  double offset = 0;   ///< Position of the encoder where the joint is at 0, in degrees (mm for linear encoders).
  double gear = 1;     ///< Turns of the encoder for one turn of the joint, above 0; rotary encoders only.
  int pole_pairs = 0;  ///< Number of pole pairs of the motor on the encoder's shaft; 0: not set; rotary encoders only.
  double pole_pair_mm = 0;  ///< Length of a pole pair of a linear motor, in mm; 0: not set; linear encoders only.
  bool is_set = false;      ///< Whether direction, offset or gear was set, so that samples have joint angles.

  /// Returns whether the pole pairs of a motor are set, so that samples have an electrical angle.
  [[nodiscard]] bool has_motor() const { return pole_pairs != 0 || pole_pair_mm > 0; }
};

/// Angles of joint and motor from one reading; a member without a value is not known.
struct JointAngles {
  /// Angle of a rotary joint, in degrees; if the encoder counts no turns, it may be wrong by whole turns of the
  /// encoder.
  std::optional<double> joint_deg{};
  std::optional<double> joint_mm{};  ///< Position of a linear joint, in millimetres.
  /// Speed of a rotary joint in revolutions per minute; without a value if it is not known.
  std::optional<Estimate> joint_speed_rpm{};
  std::optional<Estimate> joint_speed_mm_s{};  ///< Speed of a linear joint in mm/s; without a value if it is not known.
  std::optional<double> electrical_deg{};      ///< Electrical angle of the motor, in degrees, from 0 to below 360.
};

/// Returns the angle of a rotary joint from the encoder's continued angle, both in degrees.
[[nodiscard]] double joint_degrees(const Joint& joint, double position_deg);
/// Returns the position of a linear joint from that of the encoder, both in millimetres.
[[nodiscard]] double joint_millimetres(const Joint& joint, double position_mm);
/// Returns the electrical angle, 0 to below 360 degrees, from the encoder's degrees or millimetres.
[[nodiscard]] double electrical_degrees(const Joint& joint, double position);
/// Returns the speed of the joint, in the unit of `speed`, which is the speed of the encoder.
[[nodiscard]] Estimate joint_speed(const Joint& joint, const Estimate& speed);

}  // namespace absenc::client
