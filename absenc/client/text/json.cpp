// SPDX-License-Identifier: Apache-2.0
#include "absenc/client/text/json.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace absenc::client {

struct Json::Value {
  nlohmann::ordered_json json;
};

Json::Json() : value_(new Value{}) {}
Json::Json(bool value) : value_(new Value{value}) {}
Json::Json(std::int64_t value) : value_(new Value{value}) {}
Json::Json(std::uint64_t value) : value_(new Value{value}) {}
Json::Json(double value) : value_(new Value{value}) {}
Json::Json(std::string_view text) : value_(new Value{std::string(text)}) {}
Json Json::object() {
  Json made;
  made.value_->json = nlohmann::ordered_json::object();
  return made;
}
Json Json::array() {
  Json made;
  made.value_->json = nlohmann::ordered_json::array();
  return made;
}

Json::Json(const Json& other) : value_(new Value(*other.value_)) {}
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(Json other) noexcept {
  value_ = std::move(other.value_);
  return *this;
}
Json::~Json() = default;

Json& Json::set(std::string_view name, Json value) {
  value_->json[std::string(name)] = std::move(value.value_->json);
  return *this;
}

Json& Json::append(Json value) {
  value_->json.push_back(std::move(value.value_->json));
  return *this;
}

bool Json::empty() const { return value_->json.empty(); }
bool Json::is_text() const { return value_->json.is_string(); }

std::string Json::line() const {
  return value_->json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace absenc::client
