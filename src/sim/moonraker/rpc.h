// The words of JSON-RPC between the virtual Moonraker's parts.
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

/// A result, or why there is none.
struct Answer {
  Json result;
  std::optional<RpcError> error;

  [[nodiscard]] static Answer Ok(Json result = "ok") { return {std::move(result), std::nullopt}; }
  [[nodiscard]] static Answer Error(int code, std::string message) {
    return {nullptr, RpcError{code, std::move(message), {}}};
  }
};

/// The error for an argument that is not there.
[[nodiscard]] inline Answer NoData(const char* argument) {
  return Answer::Error(400, std::string("No data for argument: ") + argument);
}

/// Takes the answer to one request; called once, now or later.
using Reply = std::function<void(const Answer&)>;

/// Hostile bytes can be no valid UTF-8; they are replaced rather than thrown about.
[[nodiscard]] inline std::string ToText(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// The argument of a request, or nothing where it is absent or no text.
[[nodiscard]] inline std::optional<std::string> TextOf(const Json& params, const char* key) {
  const auto found = params.find(key);
  if (found == params.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

}  // namespace trammel::sim
