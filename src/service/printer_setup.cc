#include "service/printer_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "base/text.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "service/macros.h"
#include "session/session.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using machine::Printer;
using machine::WaitLimit;
using nlohmann::json;

constexpr const char* kPrinterFile = "printer.cfg";
constexpr const char* kMacroFile = "trammel.cfg";
constexpr std::string_view kInclude = "[include trammel.cfg]";
constexpr std::size_t kMaxBytes = 16 << 20;  // assumed: more than any configuration has
constexpr double kAsk_s = 10;
constexpr double kRestart_s = 120;  // a slow computer, and a board that is flashed anew

struct Section {
  const char* name;
  const char* purpose;
};
// Sections listed in klipper/README.md beside the macros.
constexpr Section kSections[] = {{"virtual_sdcard", "prints: without it no pattern can be printed"},
                                 {"pause_resume", "cancelling a print that ends early"},
                                 {"display_status", "messages on the printer's display"},
                                 {"respond", "dialogs on the printer's screen and in front ends"},
                                 {"save_variables", "storing a value for a filament"}};

Result<std::string> PrinterCfg(Printer& printer, const WaitLimit& limit) {
  return printer.DownloadConfig(kPrinterFile, kMaxBytes, limit);
}

// Returns the macros beside printer.cfg; absent if there are none.
Result<std::optional<std::string>> MacrosOn(Printer& printer, const WaitLimit& limit) {
  auto text = printer.DownloadConfig(kMacroFile, kMaxBytes, limit);
  if (text) return std::optional(std::move(*text));
  if (text.error().kind == ErrorKind::kInput) return std::optional<std::string>();
  return tl::unexpected(text.error());
}

// Files as they were before the change, and printer.cfg as it was left.
struct Note {
  std::string before;
  std::string after;
  std::optional<std::string> macros;  // absent: there were none
};

constexpr const char* kBefore = "before.cfg";
constexpr const char* kAfter = "after.cfg";
constexpr const char* kMacrosBefore = "macros.cfg";

Result<Note> ReadNote(const fs::path& folder) {
  const auto before = files::ReadWholeFile(folder / kBefore, kMaxBytes);
  const auto after = files::ReadWholeFile(folder / kAfter, kMaxBytes);
  if (!before || !after) return Fail("nothing was set up by this service that could be taken back");
  Note note{*before, *after, {}};
  if (auto macros = files::ReadWholeFile(folder / kMacrosBefore, kMaxBytes)) {
    note.macros = std::move(*macros);
  }
  return note;
}

// Writes the files byte for byte; printer.cfg as it is left last, without which there is no note.
Result<void> WriteNote(const fs::path& folder, const Note& note) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Fail(fmt::format("cannot make {}: {}", folder.string(), error.message()));
  fs::remove(folder / kAfter, error);
  const auto write = [&](const char* name, const std::string& text) {
    return files::WriteWholeFile(folder / name, text, files::IfThere::kReplace);
  };
  fs::remove(folder / kMacrosBefore, error);
  if (note.macros) TRY(write(kMacrosBefore, *note.macros));
  TRY(write(kBefore, note.before));
  return write(kAfter, note.after);
}

// Restarts the firmware, and waits for what becomes of it: at first it still reports the old state.
Result<void> Restart(Printer& printer, const std::stop_token& stop) {
  constexpr double kLeave_s = 5, kStep_s = 0.2;
  constexpr int kFaulty = 15;  // steps in an error: a restart passes through one
  using machine::PrinterReadiness;
  TRY(printer.CallServer("printer.firmware_restart", json::object(), {kRestart_s, {}}));
  if (stop.stop_requested()) return {};
  (void)printer.WaitUntil(
      [](const machine::PrinterState& state) {
        return state.readiness != PrinterReadiness::kReady;
      },
      "Klipper to restart", {kLeave_s, stop});
  int faulty = 0;
  for (double waited_s = 0; waited_s < kRestart_s; waited_s += kStep_s) {
    const machine::PrinterState state = printer.LastState();
    if (state.readiness == PrinterReadiness::kReady) return {};
    const bool at_fault = state.readiness == PrinterReadiness::kError ||
                          state.readiness == PrinterReadiness::kShutdown;
    faulty = at_fault ? faulty + 1 : 0;
    if (faulty > kFaulty) {
      return Fail("Klipper did not start: " + machine::FirstLine(state.message),
                  ErrorKind::kMachine);
    }
    if (!procedure::Pause(kStep_s, stop)) return Fail("stopped", ErrorKind::kInterrupted);
  }
  return Fail(fmt::format("Klipper did not start within {:.0f} s", kRestart_s),
              ErrorKind::kMachine);
}

Result<void> PutBackMacros(Printer& printer, const Note& note, const WaitLimit& limit) {
  if (note.macros) return printer.UploadConfig(kMacroFile, *note.macros, limit);
  if (!TRY(MacrosOn(printer, limit))) return {};
  TRY(printer.CallServer("server.files.delete_file",
                         {{"path", fmt::format("config/{}", kMacroFile)}}, limit));
  return {};
}

// The include goes first: without its file Klipper would not start. One that the owner had stays.
Result<void> PutBack(Printer& printer, const Note& note, const WaitLimit& limit) {
  const std::string now = TRY(PrinterCfg(printer, limit));
  const std::string restored = now == note.after           ? note.before
                               : note.before == note.after ? now
                                                           : WithoutInclude(now);
  if (restored != now) TRY(printer.UploadConfig(kPrinterFile, restored, limit));
  return PutBackMacros(printer, note, limit);
}

std::vector<MissingSection> MissingOf(const json& status) {
  const json settings = status.value("/configfile/settings"_json_pointer, json::object());
  std::vector<MissingSection> missing;
  for (const Section& section : kSections) {
    if (settings.is_object() && settings.contains(section.name)) continue;
    missing.push_back({fmt::format("[{}]", section.name), section.purpose});
  }
  return missing;
}

bool IsInclude(std::string_view line) { return Trimmed(line) == kInclude; }

}  // namespace

json JsonOf(const PrinterSetup& setup) {
  json missing = json::array(), changes = json::array();
  for (const MissingSection& one : setup.missing) {
    missing.push_back({{"section", one.section}, {"purpose", one.purpose}});
  }
  for (const FileChange& one : setup.changes) {
    changes.push_back({{"file", one.file}, {"change", one.change}});
  }
  return {{"has_macros", setup.has_macros},
          {"missing", std::move(missing)},
          {"changes", std::move(changes)},
          {"can_undo", setup.can_undo}};
}

std::string WithInclude(std::string_view printer_cfg) {
  if (WithoutInclude(printer_cfg) != printer_cfg) return std::string(printer_cfg);
  const std::size_t end = printer_cfg.find('\n');
  const bool dos = end != std::string_view::npos && end > 0 && printer_cfg[end - 1] == '\r';
  return fmt::format("{}{}{}", kInclude, dos ? "\r\n" : "\n", printer_cfg);
}

std::string WithoutInclude(std::string_view printer_cfg) {
  std::size_t begin = 0;
  while (begin < printer_cfg.size()) {
    const std::size_t found = printer_cfg.find('\n', begin);
    const std::size_t end = found == std::string_view::npos ? printer_cfg.size() : found + 1;
    if (IsInclude(printer_cfg.substr(begin, end - begin))) {
      return fmt::format("{}{}", printer_cfg.substr(0, begin), printer_cfg.substr(end));
    }
    begin = end;
  }
  return std::string(printer_cfg);
}

Result<PrinterSetup> LookAtSetup(Printer& printer, const fs::path& note, const WaitLimit& limit) {
  PrinterSetup setup;
  setup.has_macros = TRY(printer.HasCommand(kLatestMacro, limit));
  setup.missing = MissingOf(TRY(printer.Query({{"configfile", {"settings"}}}, limit)));
  setup.can_undo = ReadNote(note).has_value();
  if (setup.has_macros) return setup;
  const std::string printer_cfg = TRY(PrinterCfg(printer, limit));
  const auto macros = TRY(MacrosOn(printer, limit));
  if (!macros) {
    setup.changes.push_back({kMacroFile, "new: macros, which nothing calls but trammel and you"});
  } else if (*macros != kMacros) {
    setup.changes.push_back({kMacroFile, "replaced by that of this trammel; the old one is kept"});
  }
  if (WithInclude(printer_cfg) != printer_cfg) {
    setup.changes.push_back({kPrinterFile, fmt::format("new first line: {}", kInclude)});
  }
  if (setup.changes.empty())
    setup.changes.push_back({kMacroFile, "loaded by a restart of Klipper"});
  return setup;
}

namespace {

Result<void> Upload(Printer& printer, const Note& note, const std::string& printer_cfg,
                    const RestartBlockerCallback& blocker, const WaitLimit& limit) {
  TRY(printer.UploadConfig(kMacroFile, kMacros, limit));
  if (TRY(PrinterCfg(printer, limit)) != printer_cfg) {
    return Fail("printer.cfg was changed meanwhile: try again", ErrorKind::kMachine);
  }
  if (note.after != printer_cfg) TRY(printer.UploadConfig(kPrinterFile, note.after, limit));
  if (const std::string why = blocker(); !why.empty()) return Fail(why, ErrorKind::kMachine);
  return {};
}

}  // namespace

Result<void> SetUpPrinter(Printer& printer, const fs::path& folder,
                          const RestartBlockerCallback& blocker, const std::stop_token& stop) {
  const WaitLimit limit{kAsk_s, stop};
  const std::string printer_cfg = TRY(PrinterCfg(printer, limit));
  Note note{printer_cfg, WithInclude(printer_cfg), TRY(MacrosOn(printer, limit))};
  // The files to go back to are those before the first of several changes.
  if (auto earlier = ReadNote(folder); earlier && earlier->after == note.before) {
    note.before = std::move(earlier->before);
    note.macros = std::move(earlier->macros);
  }
  TRY(WriteNote(folder, note));
  const auto uploaded = Upload(printer, note, printer_cfg, blocker, limit);
  const auto done = uploaded ? Restart(printer, stop) : uploaded;
  if (done) return {};
  auto back = PutBack(printer, note, {kAsk_s, {}});
  if (back && uploaded) back = Restart(printer, stop);
  if (!back) {
    return Fail(
        fmt::format("{}; the files could not be taken back: {}. Remove '{}' from printer.cfg",
                    done.error().message, back.error().message, kInclude),
        ErrorKind::kMachine);
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return Fail("everything was taken back: " + done.error().message, ErrorKind::kMachine);
}

Result<void> UndoSetUp(Printer& printer, const fs::path& folder,
                       const RestartBlockerCallback& blocker, const std::stop_token& stop) {
  const Note note = TRY(ReadNote(folder));
  TRY(PutBack(printer, note, {kAsk_s, stop}));
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  const std::string why = blocker();
  const auto restarted =
      why.empty() ? Restart(printer, stop) : Result<void>(Fail(why, ErrorKind::kMachine));
  if (restarted) return {};
  return Fail(
      "the files are as they were before; restart Klipper yourself: " + restarted.error().message,
      ErrorKind::kMachine);
}

}  // namespace trammel::service
