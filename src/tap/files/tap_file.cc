#include "tap/files/tap_file.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/text.h"
#include "files/json_object.h"
#include "files/whole_file.h"
#include "tap/files/moves_from_z.h"
#include "tap/files/tap_csv.h"

namespace trammel::files {
namespace {

using nlohmann::json;
using tap::Move;
using tap::Recording;

/// Upper limit of a file's size: ten thousand taps of a thousand samples are smaller. A number of
/// two bytes becomes one of eight.
constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
/// Size limit of one JSON value: parsing needs up to eight times as much memory. More taps must be
/// written as JSON lines.
constexpr std::size_t kMaxJsonBytes = std::size_t{64} << 20;
constexpr std::size_t kMaxMoves = 1000;
constexpr std::size_t kMaxTaps = 100'000;

/// Reads numbers; null is a sample without one.
std::vector<double> Samples(JsonObject& object, const char* key) {
  std::vector<double> samples;
  for (const auto& value : object.OptionalNumbers(key, 0, kMaxTapSamples)) {
    samples.push_back(value.value_or(Recording::kUnknown));
  }
  return samples;
}

Result<Move> ReadMove(JsonObject object, Recording& recording) {
  const Move move{object.Number("print_time"), object.Number("move_t"),  object.Number("start_v"),
                  object.Number("accel"),      object.Number("start_z"), object.Number("z_r")};
  recording.x_mm = object.OptionalNumber("start_x").value_or(recording.x_mm);
  recording.y_mm = object.OptionalNumber("start_y").value_or(recording.y_mm);
  TRY(object.Faults());
  return move;
}

/// Reads the printer's own result, if there is one: the last of tap_pos = [x, y, z].
std::optional<double> FirmwareZ(const json& object) {
  if (object.contains("x_firmware_z_mm") && object.at("x_firmware_z_mm").is_number()) {
    return object.at("x_firmware_z_mm").get<double>();
  }
  if (object.contains("is_valid") && object.at("is_valid") == json(false)) return std::nullopt;
  if (!object.contains("tap_pos")) return std::nullopt;
  const json& position = object.at("tap_pos");
  if (!position.is_array() || position.size() != 3 || !position[2].is_number()) return std::nullopt;
  return position[2].get<double>();
}

Result<Recording> ReadTap(const json& json_tap, const std::string& name, const std::string& path) {
  JsonObject object(json_tap, name, path);
  Recording recording;
  for (const char* key : {"time", "force"}) {
    if (!object.has(key)) object.Fault(key, "is missing; a tap has the lists time and force");
  }
  recording.time_s = Samples(object, "time");
  recording.force_g = Samples(object, "force");
  recording.z_mm = Samples(object, "z");
  for (const auto& [key, values] :
       {std::pair{"force", &recording.force_g}, std::pair{"z", &recording.z_mm}}) {
    const bool absent = values == &recording.z_mm && values->empty();
    if (!absent && values->size() != recording.time_s.size()) {
      object.Fault(key, fmt::format("has {} entries and time has {}; every sample needs both",
                                    values->size(), recording.time_s.size()));
    }
  }
  const json* moves = object.OptionalList("moves", 0, kMaxMoves);
  TRY(object.Faults());
  for (std::size_t i = 0; moves != nullptr && i < moves->size(); ++i) {
    auto move = TRY(ReadMove(object.Inner((*moves)[i], fmt::format("moves[{}]", i)), recording));
    recording.moves.push_back(move);
  }
  recording.nozzle_temperature_c =
      object.OptionalNumber("x_nozzle_temperature_c").value_or(Recording::kUnknown);
  recording.firmware_z_mm = FirmwareZ(json_tap);
  TRY(object.Faults());
  return recording;
}

/// Finds the taps within lists and notifications, in order.
class TapFinder {
 public:
  TapFinder(std::string name, std::vector<Recording>& taps) : name_(std::move(name)), taps_(taps) {}

  Result<void> Find(const json& value, const std::string& path) {
    if (value.is_array()) {
      for (std::size_t i = 0; i < value.size(); ++i) {
        TRY(Find(value[i], fmt::format("{}[{}]", path, i)));
      }
      return {};
    }
    if (!value.is_object()) {
      return Fail(fmt::format("{}: {} is {}; a tap is an object with time and force", name_,
                              path.empty() ? "the file's content" : path, Show(value)));
    }
    for (const char* inner : {"params", "tap", "taps"}) {
      if (value.contains(inner)) {
        return Find(value.at(inner), path.empty() ? inner : path + "." + inner);
      }
    }
    return Add(value, path);
  }

 private:
  Result<void> Add(const json& value, const std::string& path) {
    // A printer's reply to a subscription precedes the taps.
    if (!value.contains("time") && !value.contains("force") &&
        (value.contains("result") || value.contains("header"))) {
      return {};
    }
    if (taps_.size() >= kMaxTaps) {
      return Fail(fmt::format("{}: has more than {} taps; split it", name_, kMaxTaps));
    }
    auto tap = TRY(ReadTap(value, name_, path));
    taps_.push_back(std::move(tap));
    return {};
  }

  std::string name_;
  std::vector<Recording>& taps_;
};

Result<void> CheckPiece(std::uintmax_t bytes, const std::string& name) {
  if (bytes <= kMaxJsonBytes) return {};
  return Fail(
      fmt::format("{}: is {} MB of JSON in one piece and at most {} MB are read; write "
                  "one tap per line (JSON lines)",
                  name, bytes >> 20, kMaxJsonBytes >> 20));
}

Result<void> ParseValue(std::string_view text, const std::string& name,
                        std::vector<Recording>& taps) {
  TRY(CheckPiece(text.size(), name));
  const auto root = ParseJson(text, name);
  if (!root) {
    return Fail(fmt::format("{}. Was the file cut off, or does it hold NaN, which is not JSON?",
                            root.error().message));
  }
  return TapFinder(name, taps).Find(*root, "");
}

/// True if the first line is a complete value and others follow.
bool IsJsonLines(std::string_view text) {
  const std::size_t end = text.find('\n');  // npos is beyond any bound
  if (end > kMaxJsonBytes) return false;
  return json::accept(text.substr(0, end));
}

Result<void> ParseLines(std::string_view text, const std::string& name,
                        std::vector<Recording>& taps) {
  std::size_t line = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view piece = Trimmed(text.substr(0, end));
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
    ++line;
    if (piece.empty()) continue;
    TRY(ParseValue(piece, fmt::format("{} line {}", name, line), taps));
  }
  return {};
}

/// Adds moves and notices known before the analysis.
void Complete(Recording& recording) {
  if (recording.moves.empty() && !recording.z_mm.empty()) {
    recording.moves = MovesFromZ(recording.time_s, recording.z_mm);
    recording.notices.push_back(
        recording.moves.empty()
            ? "moves are missing and z does not show one descent, a rest and one rise"
            : "moves were derived from z; when the head accelerated is known to one sample");
  }
}

void Name(std::vector<Recording>& taps, const std::string& name) {
  for (std::size_t i = 0; i < taps.size(); ++i) {
    taps[i].name = taps.size() == 1 ? name : fmt::format("{} tap {}", name, i + 1);
    Complete(taps[i]);
  }
}

Result<std::vector<Recording>> ReadCsv(const std::filesystem::path& file, std::string_view text) {
  auto recording = TRY(ParseTapCsv(text, file.string()));
  std::filesystem::path moves = file;
  moves.replace_extension(".moves.csv");
  std::error_code ignored;
  if (std::filesystem::exists(moves, ignored)) {
    const auto table = TRY(ReadNamedFile(moves, kMaxJsonBytes));
    TRY(ParseMovesCsv(table, moves.string(), recording));
  }
  std::vector<Recording> taps;
  taps.push_back(std::move(recording));
  Name(taps, file.string());
  return taps;
}

bool IsJson(std::string_view text, const std::filesystem::path& file) {
  const std::string_view start = Trimmed(text.substr(0, 4096));
  const std::size_t mark = start.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  const bool begins = start.size() > mark && (start[mark] == '{' || start[mark] == '[');
  return begins || file.extension() == ".json" || file.extension() == ".jsonl";
}

/// Refuses too large JSON in one piece by its beginning, before the rest is read.
Result<void> CheckSize(const std::filesystem::path& file) {
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(file, unknown);
  if (unknown || size <= kMaxJsonBytes) return {};
  std::ifstream stream(file, std::ios::binary);
  std::string head(kMaxJsonBytes, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  const std::string_view start = Trimmed(head);
  if (!IsJson(start, file) || IsJsonLines(start)) return {};
  return CheckPiece(size, file.string());
}

}  // namespace

Result<std::vector<Recording>> ParseTaps(std::string_view text, const std::string& name) {
  text = Trimmed(text);
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<Recording> taps;
  TRY(IsJsonLines(text) ? ParseLines(text, name, taps) : ParseValue(text, name, taps));
  if (taps.empty()) {
    return Fail(
        fmt::format("{}: holds no tap; a tap is an object with time, force and moves", name));
  }
  Name(taps, name);
  return taps;
}

Result<std::vector<Recording>> ReadTaps(const std::filesystem::path& file) {
  TRY(CheckSize(file));
  const auto text = TRY(ReadWholeFile(file, kMaxBytes));
  if (Trimmed(std::string_view(text).substr(0, 4096)).empty()) {
    return Fail(
        fmt::format("{}: is empty; it must hold taps as JSON, JSON lines or CSV", file.string()));
  }
  if (IsJson(text, file)) return ParseTaps(text, file.string());
  return ReadCsv(file, text);
}

}  // namespace trammel::files
