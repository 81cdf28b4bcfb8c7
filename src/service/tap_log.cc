#include "service/tap_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/bounded_json.h"
#include "machine/net/json_field.h"
#include "measurement/applied.h"
#include "service/job_record.h"
#include "session/crash_recovery.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::string_view kEnding = ".jsonl";
constexpr const char* kCurve = "curve";

// Returns the time in the name of a file of taps, "20260102T030405Z"; empty: it is none.
std::string TimeOf(const fs::path& file) {
  const std::string name = file.stem().string();
  const std::size_t dash = name.find('-');
  const bool ours = name.starts_with("tap") && IsRunId(name) && dash != std::string::npos;
  return ours && file.extension() == kEnding ? name.substr(dash + 1) : std::string();
}

// Reads at most `size` bytes from `offset` on.
std::string ReadPart(const fs::path& file, std::uintmax_t offset, std::uintmax_t size) {
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, stream.gcount())));
  return bytes;
}

// Returns the answer in a line; null: it has none.
json AnswerIn(std::string_view line) {
  if (line.find(kTapAnswer) == std::string_view::npos) return nullptr;
  const auto tap = ParseBoundedJson(line, "a tap");
  const json* const answer = tap ? machine::Member(*tap, kTapAnswer) : nullptr;
  return answer != nullptr && answer->is_object() ? *answer : json();
}

bool IsOf(const json& answer, const std::string& printer) {
  return procedure::PrinterName(machine::TextOr(answer, "printer", "")) == printer;
}

}  // namespace

json NewestTaps(const fs::path& recordings, const std::string& printer, std::size_t last) {
  constexpr std::uintmax_t kMaxRead = 32 << 20;
  std::vector<std::pair<std::string, fs::path>> files;
  std::error_code error;
  for (fs::directory_iterator file(recordings, error), end; !error && file != end;
       file.increment(error)) {
    std::error_code gone;
    std::string time = TimeOf(file->path());
    if (!time.empty() && fs::is_regular_file(file->symlink_status(gone))) {
      files.emplace_back(std::move(time), file->path());
    }
  }
  std::ranges::sort(files, std::greater{});
  json taps = json::array();
  std::uintmax_t room = kMaxRead;
  for (const auto& [time, file] : files) {
    std::error_code gone;
    const std::uintmax_t size = fs::file_size(file, gone);
    const std::uintmax_t read = gone ? 0 : std::min(size, room);
    room -= read;
    const std::string bytes = ReadPart(file, size - read, read);
    std::size_t end = bytes.size();
    while (end > 0 && taps.size() < last) {
      const std::size_t feed = bytes.rfind('\n', end - 1);
      const std::size_t begin = feed == std::string::npos ? 0 : feed + 1;
      json answer = AnswerIn(std::string_view(bytes).substr(begin, end - begin));
      if (answer.is_object() && IsOf(answer, printer)) {
        answer.erase(kCurve);
        answer["tap"] = fmt::format("{}:{}", file.stem().string(), size - read + begin);
        taps.push_back(std::move(answer));
      }
      end = begin == 0 ? 0 : begin - 1;
    }
    if (room == 0 || taps.size() >= last) break;
  }
  return taps;
}

Result<json> TapIn(const fs::path& recordings, const std::string& tap) {
  const std::size_t colon = tap.find(':');
  const std::string stem = tap.substr(0, colon);
  const std::string offset = colon == std::string::npos ? "" : tap.substr(colon + 1);
  constexpr std::size_t kMaxDigits = 15;
  const bool digits = !offset.empty() && offset.size() <= kMaxDigits &&
                      offset.find_first_not_of("0123456789") == std::string::npos;
  const fs::path file = recordings / (stem + std::string(kEnding));
  std::error_code gone;
  const bool there =
      digits && !TimeOf(file).empty() && fs::is_regular_file(fs::symlink_status(file, gone));
  const std::uintmax_t at = there ? std::stoull(offset) : 0;
  if (!there || at >= fs::file_size(file, gone)) return Fail("there is no such tap");
  const std::string bytes = ReadPart(file, at, files::kMaxLineBytes);
  json answer = AnswerIn(std::string_view(bytes).substr(0, bytes.find('\n')));
  if (!answer.is_object()) return Fail("there is no such tap");
  answer["tap"] = tap;
  return answer;
}

}  // namespace trammel::service
