#include "tool_offset/commands/offset_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <system_error>
#include <utility>

#include "files/new_file.h"
#include "tool_offset/commands/offset_reading.h"
#include "tool_offset/procedure/guided_offsets.h"
#include "tool_offset/procedure/sheet_print.h"
#include "tool_offset/report/sheet_preview.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDrawings[] = {".svg", ".png"};

std::string WhyNoTool(const report::OffsetAnalysis& analysis) {
  std::string why;
  for (const tool_offset::CombinedTool& tool : analysis.combined.tools) {
    why += fmt::format("{}T{}: {}", why.empty() ? "" : "; ", tool.tool, report::ReasonOf(tool));
  }
  return why;
}

/// Lists the printer's own offsets for the page, as they were when the sheet was printed.
std::vector<report::KeptChange> KeptOf(const files::StartRecord& record,
                                       const report::OffsetAnalysis& analysis) {
  files::OffsetFile measured;
  for (const tool_offset::CombinedTool& tool : analysis.combined.tools) {
    if (report::VerdictOf(tool) != Verdict::kGood) continue;
    measured.good.push_back({tool.tool, tool.dx_mm.quantity().value, tool.dy_mm.quantity().value});
  }
  std::vector<report::KeptChange> kept;
  for (const procedure::OffsetCorrection& change : procedure::CorrectionsOf(record, measured)) {
    kept.push_back({change.tool, change.now, change.next});
  }
  return kept;
}

}  // namespace

std::vector<fs::path> SheetFiles(const fs::path& gcode) {
  std::vector<fs::path> paths = {gcode};
  for (const char* ending : kDrawings) paths.push_back(fs::path(gcode).replace_extension(ending));
  return paths;
}

Result<void> WriteSheet(const fs::path& path, const tool_offset::SheetPlan& plan,
                        const tool_offset::SheetGcode& gcode, files::IfThere there) {
  const report::Canvas drawing = report::SheetPreview(plan);
  for (const fs::path& file : SheetFiles(path)) {
    const std::string ending = file.extension().string();
    const std::string bytes = ending == kDrawings[0]   ? drawing.ToSvg()
                              : ending == kDrawings[1] ? drawing.ToPng()
                                                       : gcode.text;
    TRY(files::WriteWholeFile(file, bytes, there));
  }
  return {};
}

void RemoveSheet(const fs::path& path) {
  std::error_code ignored;
  for (const fs::path& file : SheetFiles(path)) fs::remove(file, ignored);
}

Result<fs::path> ScanFolderOf(const fs::path& folder) {
  const fs::path scans = folder / "scan";
  std::error_code error;
  fs::create_directories(scans, error);
  if (error) return Fail(fmt::format("{}: cannot be made: {}", scans.string(), error.message()));
  return scans;
}

SheetReader::SheetReader(fs::path folder, tool_offset::SheetPlan plan, files::StartRecord record,
                         ReadingOptions reading)
    : folder_(std::move(folder)),
      plan_(std::move(plan)),
      record_(std::move(record)),
      reading_(std::move(reading)) {}

// Copies the scan, unless it is in the folder already.
Result<fs::path> SheetReader::Keep(const fs::path& scan) const {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(scan, error);
  const fs::path home = fs::weakly_canonical(folder_, error);
  const fs::path below = whole.lexically_relative(home);
  if (!below.empty() && *below.begin() != "..") return scan;
  constexpr int kMax = 100;
  for (int i = 1; i <= kMax; ++i) {
    const std::string name = i == 1 ? std::string("scan") : fmt::format("scan-{}", i);
    const fs::path copy = folder_ / (name + scan.extension().string());
    if (fs::exists(copy, error)) continue;
    if (fs::copy_file(scan, copy, error)) return copy;
    std::error_code ignored;
    fs::remove(copy, ignored);
    return Fail(
        fmt::format("{} cannot be kept as {}: {}", scan.string(), copy.string(), error.message()));
  }
  return Fail(fmt::format("{}: keeps {} scans already", folder_.string(), kMax));
}

Result<bool> SheetReader::Read(const fs::path& scan) { return ReadTogether({scan}, {}); }

Result<bool> SheetReader::ReadTogether(const std::vector<fs::path>& scans,
                                       const std::function<void(const std::string&)>& left_out) {
  std::vector<std::string> files;
  for (const fs::path& path : scans) files.push_back(path.string());
  ReadSheets read = ReadScans(files, plan_, reading_, true);
  report::OffsetAnalysis& analysis = read.analysis;
  if (analysis.scans.empty()) return tl::unexpected(read.errors.front());
  for (const Error& error : read.errors) left_out("left out: " + error.message);
  const auto& tools = analysis.combined.tools;
  const auto good = [](const tool_offset::CombinedTool& tool) {
    return report::VerdictOf(tool) == Verdict::kGood;
  };
  if (std::none_of(tools.begin(), tools.end(), good)) {
    return Fail(fmt::format("{}: it is the sheet, and no tool could be read: {}",
                            scans.front().string(), WhyNoTool(analysis)),
                ErrorKind::kMeasurement);
  }
  std::map<std::string, std::string> copies;
  for (report::OffsetScan& each : analysis.scans) {
    std::string& copy = copies[each.source];
    if (copy.empty()) {
      const auto kept = TRY(Keep(each.source));
      copy = kept.string();
    }
    each.source = copy;
  }
  OffsetOutput output;
  output.recording = folder_.string();
  output.subject.printer = record_.printer;
  output.report = (folder_ / "report.html").string();
  output.picture = (folder_ / kOffsetPicture).string();
  output.force = true;  // overwrites an earlier scan of the same print
  TRY(WriteOffsetOutput(output, {&analysis, std::move(read.pictures), KeptOf(record_, analysis)}));
  record_.stage = files::StartStage::kAnalysed;
  TRY(files::WriteStart(folder_, record_));
  all_good_ = report::VerdictOf(analysis) == Verdict::kGood;
  std::fputs(report::OffsetText(analysis, output.report).c_str(), stdout);
  return true;
}

}  // namespace trammel::app
