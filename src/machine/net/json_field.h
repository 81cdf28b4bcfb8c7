// JSON fields from an untrusted server: a wrong type counts as absent.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace trammel::machine {

/// Returns the member, or nullptr if `object` is no object or has none of that name.
[[nodiscard]] inline const nlohmann::json* Member(const nlohmann::json& object,
                                                  std::string_view name) {
  if (!object.is_object()) {
    return nullptr;
  }
  const auto found = object.find(std::string(name));
  return found == object.end() ? nullptr : &*found;
}

[[nodiscard]] inline std::optional<double> Number(const nlohmann::json& object,
                                                  std::string_view name) {
  const nlohmann::json* member = Member(object, name);
  if (member == nullptr || !member->is_number() || !std::isfinite(member->get<double>())) {
    return std::nullopt;
  }
  return member->get<double>();
}

[[nodiscard]] inline double NumberOr(const nlohmann::json& object, std::string_view name,
                                     double otherwise) {
  return Number(object, name).value_or(otherwise);
}

[[nodiscard]] inline std::string TextOr(const nlohmann::json& object, std::string_view name,
                                        const std::string& otherwise) {
  const nlohmann::json* member = Member(object, name);
  return member != nullptr && member->is_string() ? member->get<std::string>() : otherwise;
}

[[nodiscard]] inline bool BoolOr(const nlohmann::json& object, std::string_view name,
                                 bool otherwise) {
  const nlohmann::json* member = Member(object, name);
  return member != nullptr && member->is_boolean() ? member->get<bool>() : otherwise;
}

/// Returns the member object, or an empty object.
[[nodiscard]] inline const nlohmann::json& ObjectOr(const nlohmann::json& object,
                                                    std::string_view name) {
  static const nlohmann::json kEmpty = nlohmann::json::object();
  const nlohmann::json* member = Member(object, name);
  return member != nullptr && member->is_object() ? *member : kEmpty;
}

}  // namespace trammel::machine
