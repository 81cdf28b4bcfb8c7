#include "session/screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/bounded_json.h"
#include "base/utf8.h"

namespace trammel::procedure {
namespace {

constexpr const char* kCloseMacro = "_TRAMMEL_CLOSE";  // of klipper/trammel.cfg
constexpr const char* kEcho = "M118 trammel: {}";

const char* NameOf(Buttons buttons) {
  switch (buttons) {
    case Buttons::kStart:
      return "start";
    case Buttons::kPrint:
      return "print";
    case Buttons::kPhoto:
      return "photo";
    case Buttons::kSheet:
      return "sheet";
    case Buttons::kScan:
      return "scan";
    case Buttons::kUse:
      return "use";
    case Buttons::kClose:
      break;
  }
  return "close";
}

std::string WithoutMiddle(std::string plain) {
  constexpr std::size_t kMax = 1000;  // some ten lines of a phone's dialog
  constexpr std::string_view kGap = " ... ";
  if (plain.size() > kMax) {
    plain.replace(kMax / 2, plain.size() - kMax + kGap.size(), kGap);
  }
  return plain;
}

// True if the text needs no quotation marks, and neither ends a command nor begins a comment.
bool IsWord(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '.' || c == ',' || c == '-';
  });
}

}  // namespace

std::string Screen::Plain(std::string_view text) {
  std::string plain;
  for (const char c : text.substr(0, text.find('\n'))) {
    const bool printable = c > ' ' && c <= '~';
    const bool special = c == '"' || c == '\\' || c == ';' || c == '#' || c == '*';
    if (c == ';' && !plain.empty() && plain.back() != ' ') {  // start of a comment
      plain += ',';
    } else if (printable && !special) {
      plain += c;
    } else if (!plain.empty() && plain.back() != ' ') {
      plain += ' ';
    }
  }
  return WithoutMiddle(std::move(plain));
}

void Screen::LearnCommands(const machine::WaitLimit& limit) {
  if (learnt_) return;
  say_.clear();
  bool told = true;
  const auto has = [&](const char* command) {
    const auto known = printer_.HasCommand(command, limit);
    told = told && known.has_value();
    return known && *known;
  };
  for (const auto& [command, call] :
       {std::pair{"TRAMMEL_SAY", "TRAMMEL_SAY MSG=\"{}\""},
        std::pair{"RESPOND", "RESPOND TYPE=echo MSG=\"trammel: {}\""}, std::pair{"M118", kEcho}}) {
    if (say_.empty() && has(command)) say_ = call;
  }
  has_display_ = has("M117");
  has_dialogs_ = has("TRAMMEL_ASK");
  closes_dialogs_ = has(kCloseMacro);
  // A server that does not answer is queried again later; meanwhile the commonest command is used.
  if (!told && say_.empty()) say_ = kEcho;
  // A printer in shutdown lists only the few commands available then. Among them is RESPOND, which
  // never fails and would be used forever.
  learnt_ = told && printer_.LastState().readiness == machine::PrinterReadiness::kReady;
}

Result<void> Screen::Show(std::string_view text, const machine::WaitLimit& limit) {
  LearnCommands(limit);
  const std::string plain = Plain(text);
  std::string script = say_.empty() ? "" : fmt::format(fmt::runtime(say_), plain);
  if (has_display_) script += (script.empty() ? "" : "\n") + ("M117 " + plain);
  if (std::exchange(dialog_open_, false) && closes_dialogs_) {
    script += (script.empty() ? "" : "\n") + std::string(kCloseMacro);
  }
  if (script.empty()) return {};
  auto shown = printer_.Run(script, limit);
  if (!shown) learnt_ = false;  // another configuration may have come with a restart
  return shown;
}

Result<void> Screen::Ask(std::string_view text, Buttons buttons,
                         const std::map<std::string, std::string>& start,
                         const machine::WaitLimit& limit) {
  learnt_ = false;  // the macros may have come with a restart since
  LearnCommands(limit);
  if (!has_dialogs_) return {};
  std::string plain = Plain(text);
  std::replace(plain.begin(), plain.end(), '|', ' ');  // begins a button's G-code
  std::string handed_on;
  for (const auto& [name, value] : start) {
    if (!IsWord(value)) continue;
    handed_on += ' ';
    for (const char c : name)
      handed_on += static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    handed_on += "=" + value;
  }
  auto asked = printer_.Run(
      fmt::format("TRAMMEL_ASK BUTTONS={}{} MSG=\"{}\"", NameOf(buttons), handed_on, plain), limit);
  dialog_open_ = asked.has_value();
  return asked;
}

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
  constexpr JsonBounds kBounds{.max_bytes = 8192, .max_levels = 2, .max_memory_bytes = 1 << 16};
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
