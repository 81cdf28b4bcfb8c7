// JSON-RPC types shared by the virtual Moonraker's parts.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace trammel::sim {

using Json = nlohmann::json;

struct RpcError {
  int code = 400;
  std::string message;
  std::optional<Json> data = {};  ///< an agent's own error
};

/// Result, or the error.
struct Answer {
  Json result;
  std::optional<RpcError> error;

  [[nodiscard]] static Answer Ok(Json result = "ok") { return {std::move(result), std::nullopt}; }
  [[nodiscard]] static Answer Error(int code, std::string message) {
    return {nullptr, RpcError{code, std::move(message), {}}};
  }
};

/// Returns the error of a missing argument.
[[nodiscard]] inline Answer NoData(const char* argument) {
  return Answer::Error(400, std::string("No data for argument: ") + argument);
}

/// Receives the answer to one request; called once, at once or later.
using Reply = std::function<void(const Answer&)>;

/// Replaces invalid UTF-8 of hostile bytes instead of throwing.
[[nodiscard]] inline std::string ToText(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Returns the argument of a request; absent if it is missing or no text.
[[nodiscard]] inline std::optional<std::string> TextOf(const Json& params, const char* key) {
  const auto found = params.find(key);
  if (found == params.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

}  // namespace trammel::sim
