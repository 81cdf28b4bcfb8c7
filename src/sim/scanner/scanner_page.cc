#include "sim/scanner/scanner_page.h"

#include <algorithm>
#include <array>
#include <utility>

#include "sim/scanner/scanner_coverage.h"
#include "sim/scanner/scanner_map.h"
#include "sim/scanner/scanner_optics.h"

namespace trammel::sim {
namespace {

constexpr int kBandRows = 64;

// The inks of one band of rows, kept from band to band for their memory.
struct Band {
  std::array<CoverageRows, kInkCount> coverages;
  std::array<bool, kInkCount> has_ink{};
  CoverageRows raised;
  Columns columns;
};

}  // namespace

struct SheetScan::Parts {
  PrintedSheet colours;  // without its strokes
  ScannerTraits traits;
  ScannerMap map;
  PageFormat format;
  std::vector<InkOutline> outlines;  // by their top
  bool cut_off = false;

  [[nodiscard]] bool FillBand(int first_row, int rows, int halo_columns, Band& band) const;
};

SheetScan::SheetScan(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
SheetScan::SheetScan(SheetScan&&) noexcept = default;
SheetScan& SheetScan::operator=(SheetScan&&) noexcept = default;
SheetScan::~SheetScan() = default;

const PageFormat& SheetScan::format() const { return parts_->format; }
bool SheetScan::cut_off() const { return parts_->cut_off; }

std::array<double, 2> SheetScan::PlaceOf(const PlaneMm& bed) const {
  const PixelPlace place = parts_->map.PixelOf(bed);
  return {place.x_px - 0.5, place.y_px - 0.5};
}

Result<SheetScan> SheetScan::Lay(const PrintedSheet& sheet, const ScannerTraits& traits) {
  TRY(Validate(traits));
  if (sheet.strokes.empty()) return Fail("no tool printed: there is nothing to scan");
  auto map = TRY(ScannerMap::Make(sheet, traits));
  const PageFormat format{map.width_px(), map.height_px(), traits.colour ? 3 : 1, traits.bits};
  PrintedSheet colours;
  colours.inks = sheet.inks;
  colours.paper = sheet.paper;
  auto parts = std::make_unique<Parts>(Parts{std::move(colours), traits, map, format, {}, false});
  for (const InkStroke& stroke : sheet.strokes) {
    InkOutline outline = OutlineOf(stroke, parts->map);
    const bool outside = outline.left_px < 0 || outline.right_px > format.width_px ||
                         outline.top_px < 0 || outline.bottom_px > format.height_px;
    parts->cut_off |= outside && stroke.ink != kDirtInk;
    parts->outlines.push_back(std::move(outline));
  }
  std::sort(parts->outlines.begin(), parts->outlines.end(),
            [](const InkOutline& a, const InkOutline& b) { return a.top_px < b.top_px; });
  return SheetScan(std::move(parts));
}

// False: there is no ink in these rows.
bool SheetScan::Parts::FillBand(int first_row, int rows, int halo_columns, Band& band) const {
  const bool shadows = traits.shadow_strength > 0;
  band.has_ink.fill(false);
  bool any = false;
  for (const InkOutline& outline : outlines) {
    if (outline.top_px - CoverageRows::kReachPx >= first_row + rows) break;
    if (outline.bottom_px + CoverageRows::kReachPx <= first_row) continue;
    const auto ink = static_cast<std::size_t>(outline.ink);
    if (!any) band.raised.Reset(first_row, rows, format.width_px);
    if (!band.has_ink[ink]) band.coverages[ink].Reset(first_row, rows, format.width_px);
    any = true;
    band.has_ink[ink] = true;
    band.coverages[ink].Add(outline);
    if (outline.raised && shadows) band.raised.Add(outline);
  }
  if (!any) return false;
  band.raised.Sum();
  band.columns = {format.width_px, 0};
  for (std::size_t ink = 0; ink < band.coverages.size(); ++ink) {
    if (!band.has_ink[ink]) continue;
    CoverageRows& coverage = band.coverages[ink];
    coverage.Sum();
    band.columns.begin = std::min(band.columns.begin, coverage.begin() - halo_columns);
    band.columns.end = std::max(band.columns.end, coverage.end() + halo_columns);
  }
  band.columns.begin = std::max(band.columns.begin, 0);
  band.columns.end = std::min(band.columns.end, format.width_px);
  return band.columns.begin < band.columns.end;
}

Result<void> SheetScan::Render(const Random& random, const RowSink& sink) const {
  const PageFormat& format = parts_->format;
  LightRows light(parts_->colours, parts_->traits, format.width_px);
  Sensor sensor(parts_->traits, format, random);
  Band band;
  std::vector<std::uint8_t> samples(format.row_bytes());
  const int halo = light.halo_rows();
  for (int first = 0; first < format.height_px; first += kBandRows) {
    const int rows = std::min(kBandRows, format.height_px - first);
    if (parts_->FillBand(first - halo, rows + 2 * halo, light.halo_columns(), band)) {
      light.Compute(band.coverages, band.has_ink, band.raised, band.columns, rows);
    } else {
      light.ComputePaper(rows);
    }
    for (int i = 0; i < rows; ++i) {
      sensor.Read(light, i, first + i, samples);
      TRY(sink(samples));
    }
  }
  return {};
}

Result<ScannedPage> ScanSheet(const PrintedSheet& sheet, const ScannerTraits& traits,
                              const Random& random) {
  const auto scan = TRY(SheetScan::Lay(sheet, traits));
  ScannedPage page{scan.format(), {}};
  page.samples.reserve(page.format.row_bytes() * static_cast<std::size_t>(page.format.height_px));
  const auto rendered = scan.Render(random, [&page](std::span<const std::uint8_t> row) {
    page.samples.insert(page.samples.end(), row.begin(), row.end());
    return Result<void>{};
  });
  if (!rendered) return tl::unexpected(rendered.error());
  return page;
}

}  // namespace trammel::sim
