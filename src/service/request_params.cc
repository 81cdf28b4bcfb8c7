#include "service/request_params.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "service/job_record.h"
#include "service/job_server.h"

namespace trammel::service {

using machine::RpcAnswer;
using nlohmann::json;

RpcAnswer Ok(json result) { return {.result = std::move(result)}; }

RpcAnswer Invalid(const std::string& message) {
  return RpcAnswer::Refused(kInvalidParameters, message);
}

std::optional<RpcAnswer> CheckKeys(const json& params, std::initializer_list<const char*> known) {
  if (!params.is_object()) return Invalid("the arguments must be an object");
  for (const auto& [key, value] : params.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      return Invalid(fmt::format("there is no argument '{}'", key.substr(0, kMaxArgument)));
    }
  }
  return std::nullopt;
}

Result<std::string> TextOf(const json& params, const char* key, std::size_t max_bytes,
                           Lines lines) {
  const auto found = params.find(key);
  if (found == params.end() || found->is_null()) return std::string();
  const auto bad = [lines](unsigned char c) {
    return (c < ' ' && !(c == '\n' && lines == Lines::kSeveral)) || c == 0x7f;
  };
  const bool fits = found->is_string() &&
                    found->get_ref<const std::string&>().size() <= max_bytes &&
                    std::ranges::none_of(found->get_ref<const std::string&>(), bad);
  if (fits) return found->get<std::string>();
  return Fail(fmt::format("'{}' must be {} of at most {} bytes", key,
                          lines == Lines::kOne ? "one line" : "a text", max_bytes));
}

Result<std::string> RunOf(const json& params, const char* key) {
  auto id = TextOf(params, key);
  if (id && !id->empty() && !IsRunId(*id)) return Fail(fmt::format("'{}' is no run's name", key));
  return id;
}

Result<std::size_t> CountOf(const json& params, const char* key, std::size_t otherwise,
                            std::size_t most) {
  const auto found = params.find(key);
  if (found == params.end() || found->is_null()) return otherwise;
  const bool good = found->is_number_integer() && found->get<std::int64_t>() >= 1 &&
                    found->get<std::uint64_t>() <= most;
  if (good) return found->get<std::size_t>();
  return Fail(fmt::format("'{}' must be a whole number, 1 ... {}", key, most));
}

}  // namespace trammel::service
