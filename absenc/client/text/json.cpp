// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/json.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace absenc::client {

struct Json::Parts {
  nlohmann::ordered_json json;
};

Json::Json() : parts_(new Parts{}) {}
Json::Json(bool value) : parts_(new Parts{value}) {}
Json::Json(std::int64_t value) : parts_(new Parts{value}) {}
Json::Json(std::uint64_t value) : parts_(new Parts{value}) {}
Json::Json(double value) : parts_(new Parts{value}) {}
Json::Json(std::string_view text) : parts_(new Parts{std::string(text)}) {}
Json Json::object() {
  Json made;
  made.parts_->json = nlohmann::ordered_json::object();
  return made;
}
Json Json::array() {
  Json made;
  made.parts_->json = nlohmann::ordered_json::array();
  return made;
}

Json::Json(const Json& other) : parts_(new Parts(*other.parts_)) {}
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(Json other) noexcept {
  parts_ = std::move(other.parts_);
  return *this;
}
Json::~Json() = default;

Json& Json::set(std::string_view name, Json value) {
  parts_->json[std::string(name)] = std::move(value.parts_->json);
  return *this;
}

Json& Json::append(Json value) {
  parts_->json.push_back(std::move(value.parts_->json));
  return *this;
}

bool Json::empty() const { return parts_->json.empty(); }
bool Json::is_text() const { return parts_->json.is_string(); }

std::string Json::line() const {
  return parts_->json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace absenc::client
