#include "session/progress_line.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/bounded_json.h"
#include "base/utf8.h"

namespace trammel::procedure {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestText = 1024;
constexpr std::size_t kLongestPhase = 32;
constexpr double kLongest_s = 1e7;

std::optional<double> NumberWithin(const json& object, const char* key, double hi) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return std::clamp(found->get<double>(), 0.0, hi);
}

}  // namespace

std::string ProgressLine(const Progress& progress) {
  nlohmann::ordered_json line;
  line["progress"] = progress.text;
  if (progress.remaining_s) line["remaining_s"] = *progress.remaining_s;
  if (!progress.phase.empty()) line["phase"] = progress.phase;
  if (progress.done) line["done"] = *progress.done;
  return line.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::optional<Progress> ParseProgressLine(std::string_view line) {
  constexpr JsonBounds kBounds{.most_bytes = 8192, .most_levels = 2, .most_memory_bytes = 1 << 16};
  if (!line.starts_with('{')) return std::nullopt;
  const auto parsed = ParseBoundedJson(line, "the line", kBounds);
  if (!parsed || !parsed->is_object()) return std::nullopt;
  const auto text = parsed->find("progress");
  if (text == parsed->end() || !text->is_string()) return std::nullopt;
  Progress progress;
  progress.text = Utf8OrReplaced(text->get_ref<const std::string&>(), kLongestText);
  progress.remaining_s = NumberWithin(*parsed, "remaining_s", kLongest_s);
  progress.done = NumberWithin(*parsed, "done", 1);
  const auto phase = parsed->find("phase");
  if (phase != parsed->end() && phase->is_string()) {
    progress.phase = Utf8OrReplaced(phase->get_ref<const std::string&>(), kLongestPhase);
  }
  return progress;
}

}  // namespace trammel::procedure
