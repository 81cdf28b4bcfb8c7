#include "tool_offset/commands/offset_reading.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "app/number_range.h"
#include "machine/page/page_file.h"
#include "tool_offset/offset/photo_join.h"

namespace trammel::app {
namespace {

using tool_offset::PageKind;

/// The kind that somebody states.
std::optional<PageKind> StatedKind(const ReadingOptions& asked) {
  if (asked.photo || asked.film_focal_mm) return PageKind::kPhoto;
  return asked.dpi.empty() ? std::nullopt : std::optional(PageKind::kScan);
}

std::string KindWord(const std::optional<PageKind>& kind) {
  if (!kind) return "picture";
  return *kind == PageKind::kPhoto ? "photo" : "scan";
}

Result<ReadScan> AnalysePage(const Page& page, const std::string& path, int number, int sheet,
                             const tool_offset::SheetPlan& plan, const ReadingOptions& asked,
                             bool pictures) {
  tool_offset::AnalyseOptions options{page.dpi_x, page.dpi_y, StatedKind(asked), {}};
  if (!asked.dpi.empty()) {
    options.dpi_x = asked.dpi.front();
    options.dpi_y = asked.dpi.back();
  }
  options.photo.spread = asked.spread;
  options.photo.film_focal_mm = asked.film_focal_mm;
  if (!asked.film_focal_mm && page.film_focal_mm) {
    options.photo.film_focal_mm = *page.film_focal_mm;
  }
  auto result = tool_offset::AnalyseSheet(page.view(), plan, options);
  if (!result) {
    const std::string where = number > 1 ? fmt::format(", page {}", number) : "";
    return tl::unexpected(Error{
        result.error().kind,
        fmt::format("{} {}{}: {}", KindWord(options.kind), path, where, result.error().message)});
  }
  ReadScan read;
  if (pictures) {
    read.pictures = report::DrawOffsetScan(page.view(), plan, *result);
  }
  read.scan = {path, number, sheet, std::move(*result)};
  return read;
}

/// Several photos of one print answer together.
void JoinThePhotos(const tool_offset::SheetPlan& plan,
                   std::vector<tool_offset::SheetResult>& sheet) {
  const bool all = std::all_of(sheet.begin(), sheet.end(),
                               [](const auto& result) { return result.photo.has_value(); });
  if (all && sheet.size() > 1) sheet = {tool_offset::JoinPhotos(plan, sheet)};
}

}  // namespace

void AddReadingOptions(CLI::App& command, ReadingOptions& options) {
  CLI::Option* const photo = command.add_flag(
      "--photo", options.photo, "a phone's photo; without it, it is told from the picture");
  command
      .add_option("--film-focal", options.film_focal_mm,
                  "of a photo: focal length in mm as if on film of 35 mm; else as the file says, "
                  "or from the box")
      ->check(NumberIn(5.0, 1000.0));
  command
      .add_option("--dpi", options.dpi,
                  "of a scan, or along a row and down the page; else as the file says, and only "
                  "compared with what the sheet shows")
      ->expected(1, 2)
      ->check(NumberIn(20.0, 20000.0))
      ->excludes(photo)
      ->excludes("--film-focal");
}

Result<std::vector<ReadScan>> ReadScans(const std::string& path, int sheet,
                                        const tool_offset::SheetPlan& plan,
                                        const ReadingOptions& asked, bool pictures) {
  machine::PageReadOptions limits;
  limits.most_pixels = static_cast<std::int64_t>(1e6 * asked.most_megapixels);
  std::vector<ReadScan> scans;
  const auto read = machine::ForEachPage(path, limits, [&](const Page& page) -> Result<void> {
    const int number = static_cast<int>(scans.size()) + 1;
    auto scan = AnalysePage(page, path, number, sheet, plan, asked, pictures);
    if (!scan) return tl::unexpected(scan.error());
    scans.push_back(std::move(*scan));
    return {};
  });
  if (!read) return tl::unexpected(read.error());
  return scans;
}

tool_offset::CombinedResult CombineScans(const tool_offset::SheetPlan& plan,
                                         const std::vector<report::OffsetScan>& scans) {
  std::vector<std::vector<tool_offset::SheetResult>> sheets;
  int sheet = 0;
  for (const report::OffsetScan& scan : scans) {
    if (scan.sheet != sheet) sheets.emplace_back();
    sheet = scan.sheet;
    sheets.back().push_back(scan.result);
  }
  for (auto& results : sheets) JoinThePhotos(plan, results);
  return tool_offset::Combine(sheets);
}

}  // namespace trammel::app
