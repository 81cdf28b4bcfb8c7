// trammel offset measure: measures the last sheet of a printer by the scans or photos that its
// owner stored among the printer's files.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "files/new_file.h"
#include "service/job_record.h"
#include "session/crash_recovery.h"
#include "session/uploads.h"
#include "tool_offset/commands/offset_commands.h"
#include "tool_offset/commands/offset_recording.h"
#include "tool_offset/commands/offset_setting.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/guided_offsets.h"
#include "tool_offset/procedure/sheet_print.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using files::StartedSheet;
using procedure::Session;
using procedure::UploadedFile;

// Endings of readable page files (machine/page/page_file.h).
constexpr std::array<std::string_view, 6> kEndings = {".pdf",  ".png", ".jpg",
                                                      ".jpeg", ".tif", ".tiff"};
constexpr std::size_t kMaxBytes = std::size_t{128} << 20;  // A4 in colour, 600 dpi, not packed
constexpr std::size_t kMaxScans = 8;
constexpr std::int64_t kClocks_s = 10;  // between this computer and the printer's

struct MeasureArguments {
  PrinterOptions printer;
  std::string file;
  std::string sheet;
  std::string out;
  ReadingOptions reading;
};

/// Files in the folder of a run, removed unless they are kept.
class FetchedFiles {
 public:
  explicit FetchedFiles(fs::path folder) : folder_(std::move(folder)) {}
  FetchedFiles(const FetchedFiles&) = delete;
  FetchedFiles& operator=(const FetchedFiles&) = delete;
  ~FetchedFiles() {
    std::error_code ignored;
    for (const fs::path& path : paths_) fs::remove(path, ignored);
  }
  [[nodiscard]] Result<fs::path> Add(const std::string& name, std::string_view bytes) {
    const fs::path path = folder_ / name;
    TRY(files::WriteWholeFile(path, bytes, files::IfThere::kRefuse));
    paths_.push_back(path);
    return path;
  }
  void Keep() { paths_.clear(); }

 private:
  fs::path folder_;
  std::vector<fs::path> paths_;
};

/// Scan in the folder of a run, with its owner's name for it.
struct FetchedScan {
  fs::path path;
  std::string name;
};

/// Replaces paths by the owner's names: after an error the files are removed.
std::string WithNames(std::string message, const std::vector<FetchedScan>& scans) {
  for (const FetchedScan& scan : scans) {
    const std::string path = scan.path.string();
    const std::size_t at = message.find(path);
    if (at != std::string::npos) message.replace(at, path.size(), scan.name);
  }
  return message;
}

/// Returns the name of a scan in the recording, counted from 1.
std::string ScanName(std::size_t number, const std::string& ending) {
  return (number == 1 ? std::string("scan") : fmt::format("scan-{}", number)) + ending;
}

bool IsScan(const std::string& name) {
  return !procedure::EndingAmong(kEndings, name).empty() && !service::IsResultPicture(name);
}

/// Finds the scan's sheet, printed to its end.
Result<StartedSheet> FindSheet(const MeasureArguments& arguments, const Session& session,
                               const fs::path& recordings, const std::string& printer) {
  auto sheet = arguments.sheet.empty() ? files::LastStart(recordings, printer)
                                       : files::ReadStartedSheet(arguments.sheet);
  if (!sheet) return sheet;
  files::StartRecord& record = sheet->record;
  if (record.printer != printer) {
    return Fail(fmt::format("{} is of the printer {}, and {} is asked for", sheet->folder.string(),
                            record.printer, printer));
  }
  if (record.stage != files::StartStage::kPrinting) return sheet;
  const auto printed = TRY(WasPrinted(session, record.run));
  if (!printed) {
    return Fail(fmt::format("the last sheet ({}) was begun at {}, and the printer does not say "
                            "that it was printed to its end: print another one",
                            sheet->folder.string(), record.started),
                ErrorKind::kMachine);
  }
  record.stage = files::StartStage::kPrinted;
  record.printed_s = sheet->since_s;  // start of the print: its end was not observed
  TRY(files::WriteStart(sheet->folder, record));
  return sheet;
}

/// Lists uploads since the sheet was printed, or the one named: an earlier print of the same sheet
/// has the same number.
Result<std::vector<UploadedFile>> FindUploads(const std::string& named, const Session& session,
                                              const StartedSheet& sheet) {
  if (!named.empty() && !IsScan(named)) {
    return Fail(
        fmt::format("{}: must be the name of a scan or photo (.pdf, .png, .jpg, .tif) in "
                    "the folder {} beside the printer's configuration",
                    named, procedure::kUploadFolder));
  }
  auto uploads = procedure::ListUploads(session, [&named](const std::string& name) {
    return named.empty() ? IsScan(name) : name == named;
  });
  if (!uploads) return uploads;
  const bool any = !uploads->empty();
  const std::string last = any ? uploads->back().name : named;
  std::erase_if(*uploads, [&sheet](const UploadedFile& upload) {
    return upload.modified_s < static_cast<double>(sheet.since_s - kClocks_s);
  });
  if (!uploads->empty()) return uploads;
  const std::string there =
      fmt::format("the folder {} beside the printer's configuration", procedure::kUploadFolder);
  if (any) {
    return Fail(fmt::format("{} in {} is older than the sheet that was printed last, and an "
                            "earlier print of the same sheet has the same number: upload the scan "
                            "of this one",
                            last, there),
                ErrorKind::kSafety);
  }
  if (!named.empty()) return Fail(fmt::format("{} is not in {}", named, there));
  return Fail(
      fmt::format("there is no scan in {}: upload one there (PDF, PNG, JPEG or TIFF)", there));
}

/// Finds the recording with the same scan; empty: none.
Result<fs::path> MeasuredBefore(const fs::path& recordings, const std::string& ending,
                                const std::string& bytes) {
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= kMaxScans; ++i) names.push_back(ScanName(i, ending));
  return FindKeptCopy(recordings, names, bytes);
}

/// Fetches the scans that were not measured before, or the named one.
Result<std::vector<FetchedScan>> FetchScans(const MeasureArguments& arguments,
                                            const Session& session, const StartedSheet& sheet,
                                            const fs::path& recordings, FetchedFiles& fetched) {
  auto uploads = TRY(FindUploads(arguments.file, session, sheet));
  if (uploads.size() > kMaxScans) {
    uploads.erase(uploads.begin(), uploads.end() - kMaxScans);
  }
  std::vector<FetchedScan> scans;
  fs::path before;
  for (const UploadedFile& upload : uploads) {
    const auto bytes = TRY(DownloadUpload(session, upload.name, kMaxBytes));
    const std::string ending = procedure::EndingAmong(kEndings, upload.name);
    if (arguments.file.empty()) {
      auto kept = TRY(MeasuredBefore(recordings, ending, bytes));
      if (!kept.empty()) {
        before = std::move(kept);
        continue;
      }
    }
    auto path = TRY(fetched.Add(ScanName(scans.size() + 1, ending), bytes));
    scans.push_back({std::move(path), upload.name});
  }
  if (!scans.empty()) return scans;
  return Fail(
      fmt::format("{}, the newest scan there, was measured before ({}): upload another "
                  "one, or name it once more with --file",
                  uploads.back().name, before.string()));
}

void PrintCorrections(const fs::path& folder, const StartedSheet& sheet,
                      const files::OffsetFile& measured) {
  const auto corrections = procedure::CorrectionsOf(sheet.record, measured);
  for (const procedure::OffsetCorrection& change : corrections) {
    fmt::print("{}", CorrectionText(change, tool_offset::OffsetFirmware::kKlipperTool));
  }
  fmt::print("nothing applied   trammel offset apply {} {}\n", folder.string(),
             corrections.empty() ? "--for klipper-gcode-offset --now TOOL:X,Y"
                                 : fmt::format("--apply --printer {}", sheet.record.printer));
}

int RunMeasure(const MeasureArguments& arguments) {
  const Interrupt interrupt;
  const auto config = LoadSettings(arguments.printer);
  if (!config) return PrintError(config.error());
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return PrintError(printer.error());
  const Session session{**printer, interrupt.token(), ShowProgress};
  const auto folder = NewFolder::Make(arguments.out.empty()
                                          ? fs::path("recordings") /
                                                RecordingName(measurement::Instrument::kToolOffset)
                                          : fs::path(arguments.out));
  if (!folder) return PrintError(folder.error());
  const fs::path recordings = fs::absolute(folder->path()).parent_path();
  const auto sheet =
      FindSheet(arguments, session, recordings, procedure::PrinterName(config->scan.address));
  if (!sheet) return PrintError(sheet.error());
  const fs::path pattern = sheet->folder / procedure::kSheetGcodeName;
  const auto plan = ReadPlan(pattern.string());
  if (!plan) return PrintError(plan.error());
  FetchedFiles fetched(folder->path());
  const auto scans = FetchScans(arguments, session, *sheet, recordings, fetched);
  if (!scans) return PrintError(scans.error());
  session.Report({.text = "analysing", .remaining_s = {}, .phase = "analysing"});
  SheetReader reader(folder->path(), *plan, sheet->record, arguments.reading);
  std::vector<fs::path> paths;
  for (const FetchedScan& scan : *scans) paths.push_back(scan.path);
  const auto answered = reader.ReadTogether(
      paths, [&](const std::string& line) { session.Report(WithNames(line, *scans)); });
  if (!answered) {
    return PrintError({answered.error().kind, WithNames(answered.error().message, *scans)});
  }
  fetched.Keep();
  std::error_code error;  // ignored, as by trammel offset start --continue
  fs::copy_file(pattern, folder->path() / procedure::kSheetGcodeName, error);
  const auto measured = files::ReadOffsetFile(folder->path());
  if (!measured) return PrintError(measured.error());
  PrintCorrections(folder->path(), *sheet, *measured);
  return reader.all_good() ? kExitGood : kExitNotTrusted;
}

}  // namespace

void AddOffsetMeasureCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "measure", "measure the last sheet of offset start by the scans uploaded to the printer");
  const auto arguments = std::make_shared<MeasureArguments>();
  AddPrinterOptions(*command, arguments->printer);
  AddMaterialOption(*command, arguments->printer.material);
  command->add_option("--file", arguments->file,
                      "its name in the folder trammel beside printer.cfg; left out: those that "
                      "came since the print and were not measured yet");
  command
      ->add_option("--sheet", arguments->sheet,
                   "folder of the offset start that printed it; left out: the printer's last one "
                   "beside --out")
      ->check(CLI::ExistingDirectory);
  command->add_option("-o,--out", arguments->out, "new folder for scans and result");
  AddReadingOptions(*command, arguments->reading);
  command->callback([arguments, &exit_code] { exit_code = RunMeasure(*arguments); });
}

}  // namespace trammel::app
