// Arguments of clients' requests, checked.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "machine/moonraker/printer.h"

namespace trammel::service {

/// Maximum length of a text among the arguments, in bytes.
inline constexpr std::size_t kMaxArgument = 200;

[[nodiscard]] machine::RpcAnswer Ok(nlohmann::json result);
/// Refuses with kInvalidParameters.
[[nodiscard]] machine::RpcAnswer Invalid(const std::string& message);

/// Rejects arguments that are no object, or have a key unknown to the method.
[[nodiscard]] std::optional<machine::RpcAnswer> CheckKeys(const nlohmann::json& params,
                                                          std::initializer_list<const char*> known);

enum class Lines { kOne, kSeveral };

/// Returns a text among the arguments, empty if absent. Errors: another type, longer than
/// `max_bytes`, a control character (a line feed where several lines are allowed is none).
[[nodiscard]] Result<std::string> TextOf(const nlohmann::json& params, const char* key,
                                         std::size_t max_bytes = kMaxArgument,
                                         Lines lines = Lines::kOne);

/// Returns a run's id among the arguments, empty if absent. Errors: no run's name.
[[nodiscard]] Result<std::string> RunOf(const nlohmann::json& params, const char* key = "run");

/// Returns a whole number among the arguments. Errors: another type, or not in 1 … most.
[[nodiscard]] Result<std::size_t> CountOf(const nlohmann::json& params, const char* key,
                                          std::size_t otherwise, std::size_t most);

}  // namespace trammel::service
