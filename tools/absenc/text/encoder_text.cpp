// SPDX-License-Identifier: Apache-2.0
#include "tools/absenc/text/encoder_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/absenc/text/output.hpp"
#include "tools/absenc/text/reading_text.hpp"

namespace absenc::tool {

namespace {

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) print_message(fmt::format("note: {}", note));
}

}  // namespace

std::unique_ptr<Connection> open_connection(const EncoderAddress& uri) {
  std::unique_ptr<Connection> encoder = Connection::open(uri);
  print_notes(encoder->notes());
  return encoder;
}

Encoder open_encoder(const EncoderAddress& uri, Time period) {
  Encoder encoder = make_encoder(uri, period);
  encoder.connect();
  print_notes(encoder.notes());
  return encoder;
}

std::string summary(const host::Counters& counters) {
  std::string text = fmt::format("{} good", counters.good);
  if (counters.bad() != 0) {
    std::vector<std::string> kinds;
    for (std::size_t i = 0; i < counters.errors.size(); ++i) {
      if (counters.errors[i] != 0) kinds.push_back(fmt::format("{} {}", counters.errors[i], error_texts[i].name));
    }
    text += fmt::format(", {} failed ({}), {} repeated", counters.bad(), fmt::join(kinds, ", "), counters.repeated);
  }
  if (counters.discarded != 0)
    text += fmt::format(", {} damaged frames of the stream were dropped", counters.discarded);
  if (counters.late != 0) text += fmt::format(", {} came too late and were dropped", counters.late);
  return text;
}

void set_change(Json& json, const Change& change) {
  if (change.state == ChangeState::none) return;
  json.set("change", word_of(change.state));
  if (!change.advice.empty()) json.set("change_advice", change.advice);
  if (!change.note.empty()) json.set("change_note", change.note);
}

Json to_json(const Trouble& trouble) {
  Json json = Json::object().set("ok", false).set("error", text_of(trouble.error).name).set("message", trouble.message);
  if (!trouble.advice.empty()) json.set("advice", trouble.advice);
  set_change(json, trouble.change);
  return json.set("sent", trouble.sent).set("received", trouble.received);
}

std::string finding_line(const Trouble& trouble, const EncoderAddress& address) {
  return fmt::format("Looks like {}; `absenc doctor {}` says more", trouble.finding, shell_text(address.written));
}

Json errors_to_json(const host::Counters& counters) {
  Json json = Json::object();
  for (std::size_t i = 0; i < counters.errors.size(); ++i) {
    if (counters.errors[i] != 0) json.set(error_texts[i].name, counters.errors[i]);
  }
  return json;
}

std::string exchanges_text(const host::Counters& counters, std::uint64_t readings) {
  const std::string text = summary(counters);
  if (counters.good <= readings) return text;
  return fmt::format(
      "{}; {} of the good exchanges gave no reading of their own: they confirmed a position or ran a command", text,
      counters.good - readings);
}

void set_motion(Json& json, const Sample& sample, double unit_um) {
  const Json speed = sample.speed_valid ? Json(sample.speed) : Json();
  const Json uncertainty = sample.speed_valid ? Json(sample.speed_uncertainty) : Json();
  json.set("position", sample.position_valid ? Json(sample.position) : Json());
  if (unit_um > 0) {
    const double mm = micrometres(sample.position, unit_um) / 1000;
    json.set("unwrapped_mm", sample.position_valid ? Json(mm) : Json()).set("speed_mm_s", speed);
    json.set("speed_uncertainty_mm_s", uncertainty);
  } else {
    json.set("speed_rpm", speed).set("speed_uncertainty_rpm", uncertainty);
  }
}

void set_joint_speed(Json& json, const Sample& sample, const Joint& joint, double unit_um) {
  if (!joint.is_set) return;
  const std::string unit = unit_um > 0 ? "mm_s" : "rpm";
  const std::optional<Estimate>& speed = unit_um > 0 ? sample.angles.joint_speed_mm_s : sample.angles.joint_speed_rpm;
  json.set("joint_speed_" + unit, speed ? Json(speed->value) : Json());
  json.set("joint_speed_uncertainty_" + unit, speed ? Json(speed->uncertainty) : Json());
}

std::string angles_text(const Joint& joint, const Sample& sample) {
  const JointAngles& angles = sample.angles;
  const bool is_linear = sample.reading.unit_um > 0;
  const auto text = [](std::string_view what, const std::optional<double>& value, int decimals, std::string_view unit) {
    if (!value) return fmt::format("   {} unknown", what);
    return fmt::format("   {} {:.{}f} {}", what, *value, decimals, unit);
  };
  std::string line;
  if (joint.is_set)
    line += is_linear ? text("joint", angles.joint_mm, 4, "mm") : text("joint", angles.joint_deg, 4, "deg");
  if (joint.has_motor()) line += text("electrical", angles.electrical_deg, 2, "deg");
  return line;
}

}  // namespace absenc::tool
