#include "service/run_record.h"

#include <algorithm>

namespace trammel::service {

using nlohmann::json;

std::string_view ToString(RunEnd end) {
  switch (end) {
    case RunEnd::kNone:
      return "none";
    case RunEnd::kDone:
      return "done";
    case RunEnd::kFailed:
      return "failed";
    case RunEnd::kStopped:
      return "stopped";
    case RunEnd::kUnknown:
      break;
  }
  return "unknown";
}

json JsonOf(const RunRecord& run) {
  const auto known = [](const auto& value) { return value ? json(*value) : json(); };
  const auto text = [](const std::string& value) { return value.empty() ? json() : json(value); };
  return {{"run", run.id},
          {"job", run.job},
          {"arguments", run.arguments},
          {"folder", run.folder},
          {"started", run.started},
          {"ended", text(run.ended)},
          {"phase", run.phase},
          {"progress", known(run.progress)},
          {"remaining_s", known(run.remaining_s)},
          {"message", run.message},
          {"complete", run.complete()},
          {"end", run.complete() ? json(ToString(run.end)) : json()},
          {"verdict", text(run.verdict)}};
}

std::string CompactUtc(std::string utc) {
  std::erase_if(utc, [](char c) { return c == '-' || c == ':'; });
  return utc;
}

bool IsRunId(std::string_view text) {
  constexpr std::size_t kMost = 64;
  const bool plain = std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  return plain && !text.empty() && text.size() <= kMost;
}

}  // namespace trammel::service
