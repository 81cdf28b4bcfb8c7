#include "tool_offset/sheet/sheet_comments.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>
#include <span>
#include <variant>
#include <vector>

#include "settings/printer.h"
#include "settings/setting.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {
namespace {

/// Pointer to a sheet's setting of any type.
using SheetValue =
    std::variant<double*, std::optional<double>*, int*, bool*, std::string*, std::vector<double>*,
                 std::vector<int>*, gcode::Dialect*, settings::BedShape*>;

using Fault = std::optional<std::string>;

std::string Shown(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  return std::string(text.substr(0, kLongest)) + (text.size() > kLongest ? "..." : "");
}

template <class Number>
Fault ParseNumber(std::string_view text, Number& number, const char* kind) {
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || last != end) {
    return fmt::format("must be {}, is {}", kind, Shown(text));
  }
  return std::nullopt;
}

/// Quotes a text; line breaks, tabs, quotes and backslashes are escaped by a backslash.
std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    switch (c) {
      case '\n':
        out += "\\n";
        break;
      case '\r':
        out += "\\r";
        break;
      case '\t':
        out += "\\t";
        break;
      case '"':
      case '\\':
        out += '\\';
        out += c;
        break;
      default:
        out += c;
    }
  }
  return out + '"';
}

Fault Unquote(std::string_view text, std::string& out) {
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') {
    return fmt::format("must be a text in quotes, is {}", Shown(text));
  }
  text = text.substr(1, text.size() - 2);
  out.clear();
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') return Fault("a quote within the text has no backslash");
    if (text[i] != '\\') {
      out += text[i];
      continue;
    }
    constexpr std::string_view kCodes = "nrt\"\\";
    constexpr std::string_view kMeant = "\n\r\t\"\\";
    const std::size_t code =
        i + 1 < text.size() ? kCodes.find(text[i + 1]) : std::string_view::npos;
    if (code == std::string_view::npos) return Fault("a backslash stands before nothing known");
    out += kMeant[code];
    ++i;
  }
  return std::nullopt;
}

/// Parses a text into a setting of each type.
struct Parser {
  std::string_view text;

  Fault operator()(double* out) const { return ParseNumber(text, *out, "a number"); }
  Fault operator()(std::optional<double>* out) const { return (*this)(&out->emplace()); }
  Fault operator()(int* out) const { return ParseNumber(text, *out, "a whole number"); }
  Fault operator()(bool* out) const {
    if (text != "true" && text != "false") {
      return fmt::format("must be true or false, is {}", Shown(text));
    }
    *out = text == "true";
    return std::nullopt;
  }
  Fault operator()(std::string* out) const { return Unquote(text, *out); }
  template <class Number>
  Fault operator()(std::vector<Number>* out) const {
    constexpr std::size_t kMax = 64;
    if (!text.starts_with('[') || !text.ends_with(']') || text.size() < 2) {
      return fmt::format("must be a list in brackets, is {}", Shown(text));
    }
    std::string_view rest = text.substr(1, text.size() - 2);
    out->clear();
    while (!rest.empty()) {
      if (out->size() == kMax) return fmt::format("has more than {} values", kMax);
      const std::size_t end = std::min(rest.find(", "), rest.size());
      if (Fault fault = Parser{rest.substr(0, end)}(&out->emplace_back())) return fault;
      rest.remove_prefix(std::min(end + 2, rest.size()));
    }
    return std::nullopt;
  }
  Fault operator()(gcode::Dialect* out) const { return Choose(gcode::ParseDialect(text), out); }
  Fault operator()(settings::BedShape* out) const {
    return Choose(settings::ParseBedShape(text), out);
  }

 private:
  template <class Choice>
  Fault Choose(const std::optional<Choice>& choice, Choice* out) const {
    if (!choice) return fmt::format("there is no {}", Shown(text));
    *out = *choice;
    return std::nullopt;
  }
};

/// Writes a setting of each type.
struct Formatter {
  std::optional<std::string> operator()(double value) const { return fmt::format("{}", value); }
  std::optional<std::string> operator()(const std::optional<double>& value) const {
    if (!value) return std::nullopt;
    return fmt::format("{}", *value);
  }
  std::optional<std::string> operator()(int value) const { return fmt::format("{}", value); }
  std::optional<std::string> operator()(bool value) const { return value ? "true" : "false"; }
  std::optional<std::string> operator()(const std::string& value) const { return Quoted(value); }
  template <class Number>
  std::optional<std::string> operator()(const std::vector<Number>& values) const {
    return fmt::format("[{}]", fmt::join(values, ", "));
  }
  template <class Choice>
  std::optional<std::string> operator()(const Choice& value) const {
    return std::string(ToString(value));
  }
};

/// Formats numbers so that they read back exactly, lists as [1, 2], texts in quotes on one line;
/// absent if an optional setting has no value.
std::optional<std::string> FormatSheetValue(const SheetValue& value) {
  return std::visit([](const auto* v) { return Formatter{}(*v); }, value);
}

/// Sets the value.
/// @returns the fault of the text or its value, or nothing.
std::optional<std::string> ParseSheetValue(std::string_view text,
                                           const settings::SettingRange& range,
                                           const SheetValue& value) {
  if (Fault fault = std::visit(Parser{text}, value)) return fault;
  return std::visit([&](const auto* out) { return settings::FindValueProblem(range, *out); },
                    value);
}

constexpr std::string_view kPrefix = "; trammel sheet: ";
constexpr std::string_view kFormatKey = "format";
constexpr std::string_view kIdKey = "sheet_id";
constexpr std::string_view kEnd = "end";
/// Key present only in files of sheets arranged for photos.
constexpr std::string_view kForPhotoKey = "tool_offset_pattern.for_photo";

struct Entry {
  std::string key;  ///< including its section
  settings::SettingRange range;
  SheetValue value;
};

/// Returns every setting with its address.
std::vector<Entry> Entries(SheetSettings& settings) {
  std::vector<Entry> entries;
  const auto bind = [&](const auto& fields, auto& owner) {
    for (const auto& field : fields) {
      std::visit(
          [&](auto member) {
            entries.push_back(
                {fmt::format("{}.{}", field.section, field.key), field.range(), &(owner.*member)});
          },
          field.member);
    }
  };
  bind(SheetFields(), settings);
  bind(settings::PrinterFields(), settings.printer);
  bind(settings::FilamentFields(), settings.filament);
  return entries;
}

tl::unexpected<Error> FailAt(long line, const std::string& what) {
  return Fail(fmt::format("line {}: {}", line, what));
}

/// Reader of the comments of one file, line by line.
class Reader {
 public:
  /// @returns Whether this was the last of them.
  Result<bool> Take(long line, std::string_view comment) {
    if (comment == kEnd) return true;
    const std::size_t equals = comment.find(" = ");
    if (equals == std::string_view::npos) {
      return FailAt(line, fmt::format("\"{}\" is not key = value", Shortened(comment)));
    }
    const std::string key(comment.substr(0, equals));
    const std::string_view value = comment.substr(equals + 3);
    if (!seen_.insert(key).second) return FailAt(line, fmt::format("{} stands twice", key));
    if (seen_.size() == 1 && key != kFormatKey) {
      return FailAt(line, fmt::format("the first key is {}, not {}", Shortened(key), kFormatKey));
    }
    if (key == kFormatKey) return TakeFormat(line, value);
    if (key == kIdKey) return TakeNumber(line, key, value, sheet_id_);
    const auto entry = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const Entry& e) { return e.key == key; });
    if (entry == entries_.end()) {
      return FailAt(line, fmt::format("there is no setting {}", Shortened(key)));
    }
    if (const auto fault = ParseSheetValue(value, entry->range, entry->value)) {
      return FailAt(line, fmt::format("{}: {}", key, *fault));
    }
    return false;
  }

  /// Returns the settings. REQUIRES that the last comment was read.
  Result<SheetSettings> Finish() {
    for (const Entry& entry : entries_) {
      if (!seen_.contains(entry.key) && entry.key != kForPhotoKey &&
          !std::holds_alternative<std::optional<double>*>(entry.value)) {
        return Fail(fmt::format("the sheet's comments have no {}: the file is damaged", entry.key));
      }
    }
    if (!seen_.contains(std::string(kIdKey))) {
      return Fail(fmt::format("the sheet's comments have no {}: the file is damaged", kIdKey));
    }
    TRY(Validate(settings_));
    if (const int made = PlanSheet(settings_).sheet_id; made != sheet_id_) {
      return Fail(
          fmt::format("its settings make sheet {}, but it says {}: the file was changed, or "
                      "made by another version of trammel; make it anew and print that",
                      made, sheet_id_));
    }
    return settings_;
  }

 private:
  static std::string Shortened(std::string_view text) {
    constexpr std::size_t kLongest = 60;
    return std::string(text.substr(0, kLongest));
  }

  static Result<bool> TakeNumber(long line, const std::string& key, std::string_view value,
                                 int& number) {
    if (const auto fault = ParseSheetValue(value, {"", 0, 65535}, &number)) {
      return FailAt(line, fmt::format("{}: {}", key, *fault));
    }
    return false;
  }

  Result<bool> TakeFormat(long line, std::string_view value) {
    const Result<bool> taken = TakeNumber(line, std::string(kFormatKey), value, format_);
    if (taken && format_ != kSheetFormat) {
      return FailAt(line,
                    fmt::format("format {}: this trammel reads format {}; make the sheet anew "
                                "and print that",
                                format_, kSheetFormat));
    }
    return taken;
  }

  SheetSettings settings_;
  std::vector<Entry> entries_ = Entries(settings_);
  std::set<std::string> seen_;
  int format_ = kSheetFormat;
  int sheet_id_ = -1;
};

}  // namespace

std::string FormatSheetComments(const SheetPlan& plan) {
  std::string out = fmt::format("{}{} = {}\n{}{} = {}\n", kPrefix, kFormatKey, kSheetFormat,
                                kPrefix, kIdKey, plan.sheet_id);
  SheetSettings settings = plan.settings;
  for (const Entry& entry : Entries(settings)) {
    if (!settings.for_photo && entry.key == kForPhotoKey) continue;
    if (const auto value = FormatSheetValue(entry.value)) {
      out += fmt::format("{}{} = {}\n", kPrefix, entry.key, *value);
    }
  }
  return out + fmt::format("{}{}\n", kPrefix, kEnd);
}

Result<SheetSettings> ReadSheetFile(std::string_view gcode) {
  Reader reader;
  long line = 0;
  bool any = false;
  while (!gcode.empty()) {
    ++line;
    const std::size_t end = std::min(gcode.find('\n'), gcode.size());
    std::string_view text = gcode.substr(0, end);
    gcode.remove_prefix(std::min(end + 1, gcode.size()));
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (!text.starts_with(kPrefix)) continue;
    any = true;
    const bool last = TRY(reader.Take(line, text.substr(kPrefix.size())));
    if (last) return reader.Finish();
  }
  if (any) {
    return Fail(
        fmt::format("ends at line {} amid the sheet's comments: the file is cut off", line));
  }
  return Fail(
      fmt::format("has no line that begins with \"{}\": it is not a pattern of trammel "
                  "offset pattern, nor G-code of the original sheet",
                  kPrefix));
}

}  // namespace trammel::tool_offset
