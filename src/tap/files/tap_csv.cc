#include "tap/files/tap_csv.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "base/text.h"
#include "files/json_object.h"
#include "tap/files/tap_file.h"

namespace trammel::files {
namespace {

using tap::Move;
using tap::Recording;

constexpr std::size_t kMaxColumns = 64;
constexpr std::size_t kMaxMoves = 1000;

/// Reader of one table, line after line. The next call continues after the row.
class Rows {
 public:
  explicit Rows(std::string_view text) : text_(text) {
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
  }

  /// Reads the next row that is neither blank nor a comment; false at the end.
  bool Next() {
    while (!text_.empty()) {
      const std::size_t end = text_.find('\n');
      const std::string_view line = Trimmed(text_.substr(0, end));
      text_ = end == std::string_view::npos ? std::string_view{} : text_.substr(end + 1);
      ++line_;
      if (line.empty() || line.front() == '#') continue;
      Split(line);
      return true;
    }
    return false;
  }

  [[nodiscard]] std::span<const std::string_view> fields() const { return fields_; }
  [[nodiscard]] std::size_t line() const { return line_; }

 private:
  void Split(std::string_view line) {
    if (separator_ == 0) {
      separator_ = ',';
      for (const char candidate : {'\t', ';'}) {
        if (line.find(candidate) != std::string_view::npos) separator_ = candidate;
      }
    }
    fields_.clear();
    for (;;) {
      const std::size_t end = line.find(separator_);
      fields_.push_back(Trimmed(line.substr(0, end)));
      if (end == std::string_view::npos || fields_.size() > kMaxColumns) return;
      line = line.substr(end + 1);
    }
  }

  std::string_view text_;
  std::size_t line_ = 0;
  char separator_ = 0;  ///< 0 before the first row
  std::vector<std::string_view> fields_;
};

/// Parses a field: NaN if empty or "nan"; nothing if it is no number.
std::optional<double> ParseField(std::string_view field) {
  if (field.empty()) return Recording::kUnknown;
  if (field.front() == '+') field.remove_prefix(1);
  double value = 0;
  const char* const end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

std::string At(const std::string& name, std::size_t line) {
  return fmt::format("{}:{}", name, line);
}

std::string ShowField(std::string_view field) {
  return Show(nlohmann::json(std::string(field.substr(0, 80))));
}

/// Finds the column of a quantity among the names of the first row.
std::optional<std::size_t> ColumnOf(std::span<const std::string_view> names,
                                    std::initializer_list<std::string_view> wanted) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const std::string_view name : wanted) {
      if (names[i] == name) return i;
    }
  }
  return std::nullopt;
}

Result<double> FieldAt(const Rows& rows, std::size_t column, std::string_view what,
                       const std::string& name) {
  const auto fields = rows.fields();
  if (column >= fields.size()) {
    return Fail(fmt::format("{}: has {} columns, none for {}; was the file cut off here?",
                            At(name, rows.line()), fields.size(), what));
  }
  const auto value = ParseField(fields[column]);
  if (!value) {
    return Fail(fmt::format("{}: {} is {}; it must be a number with a decimal point",
                            At(name, rows.line()), what, ShowField(fields[column])));
  }
  return *value;
}

struct TapColumns {
  std::size_t time = 0;
  std::size_t force = 1;
  std::optional<std::size_t> z;
};

/// Reads the columns from the first row, which may be names or already numbers.
Result<TapColumns> ReadTapColumns(std::span<const std::string_view> first, bool& named,
                                  const std::string& name) {
  named = !first.empty() && !ParseField(first[0]);
  TapColumns columns;
  if (!named) {
    if (first.size() < 2) {
      return Fail(
          fmt::format("{}: has one column; it must have time, force and may have z, "
                      "separated by commas",
                      name));
    }
    if (first.size() > 2) columns.z = 2;
    return columns;
  }
  const auto time = ColumnOf(first, {"time", "time_s", "t"});
  const auto force = ColumnOf(first, {"force", "force_g", "force (g)"});
  if (!time || !force) {
    return Fail(
        fmt::format("{}: its first line names no column '{}'; the columns are time, force "
                    "and, where there is one, z",
                    name, time ? "force" : "time"));
  }
  columns.time = *time;
  columns.force = *force;
  columns.z = ColumnOf(first, {"z", "z_mm"});
  return columns;
}

Result<void> ReadSample(const Rows& rows, const TapColumns& columns, const std::string& name,
                        Recording& recording) {
  if (recording.time_s.size() >= kMaxTapSamples) {
    return Fail(
        fmt::format("{}: has more than {} samples; a tap has some hundreds: cut it to the "
                    "seconds around one tap",
                    name, kMaxTapSamples));
  }
  const auto time = TRY(FieldAt(rows, columns.time, "time", name));
  const auto force = TRY(FieldAt(rows, columns.force, "force", name));
  recording.time_s.push_back(time);
  recording.force_g.push_back(force);
  if (!columns.z) return {};
  const auto z = TRY(FieldAt(rows, *columns.z, "z", name));
  recording.z_mm.push_back(z);
  return {};
}

}  // namespace

Result<Recording> ParseTapCsv(std::string_view text, const std::string& name) {
  Recording recording;
  recording.name = name;
  Rows rows(text);
  if (!rows.Next()) return recording;
  bool named = false;
  const auto columns = TRY(ReadTapColumns(rows.fields(), named, name));
  for (bool more = !named || rows.Next(); more; more = rows.Next()) {
    TRY(ReadSample(rows, columns, name, recording));
  }
  return recording;
}

Result<void> ParseMovesCsv(std::string_view text, const std::string& name, Recording& recording) {
  constexpr std::array<std::string_view, 6> kNeeded = {"print_time", "move_t",  "start_v",
                                                       "accel",      "start_z", "z_r"};
  Rows rows(text);
  std::array<std::size_t, 6> columns{};
  const bool any = rows.Next();
  for (std::size_t i = 0; i < kNeeded.size(); ++i) {
    const auto column = any ? ColumnOf(rows.fields(), {kNeeded[i]}) : std::nullopt;
    if (!column) {
      return Fail(fmt::format("{}: its first line names no column '{}'; it must name {}", name,
                              kNeeded[i], fmt::join(kNeeded, ", ")));
    }
    columns[i] = *column;
  }
  const auto x = ColumnOf(rows.fields(), {"start_x"});
  const auto y = ColumnOf(rows.fields(), {"start_y"});
  while (rows.Next()) {
    if (recording.moves.size() >= kMaxMoves) {
      return Fail(fmt::format("{}: has more than {} moves; a tap has six", name, kMaxMoves));
    }
    std::array<double, 6> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto value = TRY(FieldAt(rows, columns[i], kNeeded[i], name));
      values[i] = value;
    }
    recording.moves.push_back({values[0], values[1], values[2], values[3], values[4], values[5]});
    if (!x || !y) continue;
    recording.x_mm = FieldAt(rows, *x, "start_x", name).value_or(Recording::kUnknown);
    recording.y_mm = FieldAt(rows, *y, "start_y", name).value_or(Recording::kUnknown);
  }
  return {};
}

}  // namespace trammel::files
