#include "sim/scanner/scanner_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "base/page.h"
#include "files/new_file.h"
#include "image/jpeg_writer.h"
#include "image/png_writer.h"
#include "sim/scanner/scanner_optics.h"
#include "sim/scanner/scanner_traits.h"

namespace trammel::sim {

namespace {

constexpr int kBandRows = 64;

// Inks of one band of rows, reused for their memory.
struct Band {
  std::array<CoverageRows, kInkCount> coverages;
  std::array<bool, kInkCount> has_ink{};
  CoverageRows raised;
  Columns columns;
};

}  // namespace

struct SheetScan::Parts {
  PrintedSheet colours;  // no strokes
  ScannerTraits traits;
  ScannerMap map;
  PageFormat format;
  std::vector<InkOutline> outlines;  // sorted by top edge
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
  if (sheet.strokes.empty()) return Fail("no tool printed: there is nothing to scan");
  auto map = TRY(ScannerMap::Make(sheet, traits));
  const PageFormat format{map.width_px(), map.height_px(), traits.colour ? 3 : 1, traits.bits};
  PrintedSheet colours;
  colours.inks = sheet.inks;
  colours.paper = sheet.paper;
  auto parts = std::make_unique<Parts>(Parts{std::move(colours), traits, map, format, {}, false});
  for (const InkStroke& stroke : sheet.strokes) {
    InkOutline outline =
        OutlineOf(stroke, [&](const PlaneMm& bed) { return parts->map.PixelOf(bed); });
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
  TRY(scan.Render(random, [&page](std::span<const std::uint8_t> row) {
    page.samples.insert(page.samples.end(), row.begin(), row.end());
    return Result<void>{};
  }));
  return page;
}

namespace {

using Bytes = std::vector<std::uint8_t>;

std::string Extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Result<void> WritePng(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                      const RowSink& put) {
  const PageFormat& format = scan.format();
  image::PngForm form;
  form.width_px = format.width_px;
  form.height_px = format.height_px;
  form.channels = format.channels;
  form.bits = format.bits;
  form.order = image::PngForm::Order::kRgb;
  form.dpi_x = form.dpi_y = options.dpi;
  auto png = TRY(image::PngWriter::Create(form, put));
  TRY(scan.Render(random,
                  [&](std::span<const std::uint8_t> row) { return png.WriteRow(row.data()); }));
  return png.Finish();
}

Result<void> WriteJpeg(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                       const RowSink& put) {
  const PageFormat& format = scan.format();
  Page page;
  page.width = format.width_px;
  page.height = format.height_px;
  page.channels = format.channels;
  const auto rendered = scan.Render(random, [&](std::span<const std::uint8_t> row) {
    const std::size_t begin = page.samples.size();
    page.samples.insert(page.samples.end(), row.begin(), row.end());
    for (std::size_t at = begin; format.channels == 3 && at < page.samples.size(); at += 3) {
      std::swap(page.samples[at], page.samples[at + 2]);
    }
    return Result<void>{};
  });
  if (!rendered) return rendered;
  Bytes jpeg;
  auto encoded = image::EncodeJpeg(page.view(), {options.jpeg_quality, options.dpi}, jpeg);
  return encoded ? put(jpeg) : encoded;
}

Result<void> Check(const PageFormat& format, const PageFileOptions& options,
                   const std::string& extension) {
  constexpr std::array kKnown = {".png", ".jpg", ".jpeg"};
  if (std::find(kKnown.begin(), kKnown.end(), extension) == kKnown.end()) {
    return Fail(fmt::format("'{}' is no kind of picture that is written; choose .png or .jpg",
                            extension.substr(0, 20)));
  }
  const bool jpeg = extension == ".jpg" || extension == ".jpeg";
  if (jpeg && format.bits == 16) return Fail("JPEG has 8 bits; choose --bits 8 or .png");
  if (jpeg && !(options.jpeg_quality >= 1 && options.jpeg_quality <= 100)) {
    return Fail(
        fmt::format("the JPEG quality is {}; it must lie within 1 … 100", options.jpeg_quality));
  }
  if (options.dpi && !(*options.dpi >= 1 && *options.dpi <= 60000)) {
    return Fail(
        fmt::format("the file is to say {} dpi; it must lie within 1 … 60000", *options.dpi));
  }
  return {};
}

}  // namespace

Result<void> WriteScan(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                       const std::filesystem::path& path) {
  const std::string extension = Extension(path);
  TRY(Check(scan.format(), options, extension));
  auto file = files::NewFile::Create(path, files::IfThere::kRefuse);
  if (!file) return tl::unexpected(file.error());
  const auto put = [&file](std::span<const std::uint8_t> bytes) {
    return file->Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  auto written = extension == ".png" ? WritePng(scan, random, options, put)
                                     : WriteJpeg(scan, random, options, put);
  return written ? file->Commit() : written;
}

namespace {

constexpr std::uint64_t kMachine = 1;
constexpr std::uint64_t kSheets = 100'000;  // then one generator per sheet
constexpr std::uint64_t kScans = 10;        // then one per scan

Random SheetOf(const SheetName& name) { return Random(name.seed).Fork(kSheets + name.sheet); }
Random ScanOf(const SheetName& name) { return SheetOf(name).Fork(kScans + name.scan); }

}  // namespace

SheetMachine MachineOf(const SheetName& name, SheetScene scene) {
  Random random = Random(name.seed).Fork(kMachine);
  return DrawSheetMachine(scene, random);
}

SheetPaper PaperOf(const SheetName& name, SheetScene scene) {
  Random random = SheetOf(name).Fork(0);
  return DrawSheetPaper(scene, random);
}

Random PrintingOf(const SheetName& name) { return SheetOf(name).Fork(1); }

ScannerTraits ScannerOf(const SheetName& name, const PrintedSheet& sheet) {
  Random random = ScanOf(name).Fork(0);
  return DrawScannerTraits(sheet, random);
}

Random ScanningOf(const SheetName& name) { return ScanOf(name).Fork(1); }

std::string SheetTruthJson(const SheetName& name, const PrintedSheet& sheet, int reference,
                           const ScannerTraits& scanner, const PageFormat& format) {
  using Json = nlohmann::ordered_json;
  Json tools = Json::array();
  for (const SheetToolTruth& truth : sheet.tools) {
    if (truth.tool == reference) continue;
    const auto offset = OffsetOf(sheet, truth.tool, reference);
    tools.push_back({{"tool", truth.tool},
                     {"dx_mm", offset ? Json(offset->x_mm) : Json()},
                     {"dy_mm", offset ? Json(offset->y_mm) : Json()},
                     {"printed", truth.printed}});
  }
  const Json json = {{"format", 1},
                     {"seed", name.seed},
                     {"sheet", name.sheet},
                     {"scan", name.scan},
                     {"reference", reference},
                     {"tools", tools},
                     {"backlash_mm", {{"x", sheet.backlash_mm[0]}, {"y", sheet.backlash_mm[1]}}},
                     {"scanner",
                      {{"dpi", scanner.dpi},
                       {"width_px", format.width_px},
                       {"height_px", format.height_px},
                       {"rotation_deg", scanner.rotation_rad * 180 / std::numbers::pi},
                       {"mirrored", scanner.mirrored},
                       {"scale_x", scanner.scale_x},
                       {"scale_y", scanner.scale_y},
                       {"skew", scanner.skew}}}};
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace trammel::sim
