// SPDX-License-Identifier: Apache-2.0
// A JSON value, printed on one line. Only json.cpp includes nlohmann-json.
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

namespace absenc::client {

class Json {
 public:
  /// Makes a JSON null.
  Json();
  Json(bool value);
  Json(std::int64_t value);
  Json(std::uint64_t value);
  template <std::integral Integer>
  Json(Integer value) : Json(std::conditional_t<std::is_signed_v<Integer>, std::int64_t, std::uint64_t>(value)) {}
  Json(double value);
  Json(std::string_view text);
  Json(const char* text) : Json(std::string_view(text)) {}
  Json(const std::string& text) : Json(std::string_view(text)) {}
  [[nodiscard]] static Json object();
  [[nodiscard]] static Json array();
  /// Returns a JSON array of the values `make(item)`, one for each item.
  template <class All, class Make>
  [[nodiscard]] static Json list(const All& all, const Make& make) {
    Json made = array();
    for (const auto& one : all) made.append(make(one));
    return made;
  }
  template <class All>
  [[nodiscard]] static Json list(const All& all) {
    return list(all, [](const auto& one) { return Json(one); });
  }

  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(Json other) noexcept;
  ~Json();

  /// Sets a member of an object; members keep the order in which they were first set.
  Json& set(std::string_view name, Json value);
  Json& append(Json value);
  [[nodiscard]] bool empty() const;
  [[nodiscard]] bool is_text() const;

  /// Returns the value as one line of JSON; bytes that are not UTF-8 become U+FFFD.
  [[nodiscard]] std::string line() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace absenc::client
