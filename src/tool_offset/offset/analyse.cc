#include "tool_offset/offset/analyse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/check.h"
#include "base/parallel.h"
#include "base/statistics.h"
#include "tool_offset/offset/offset_estimate.h"
#include "tool_offset/offset/sheet_model.h"
#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/reading/photo_checks.h"
#include "tool_offset/reading/structure_reader.h"
#include "tool_offset/reading/tool_search.h"

namespace trammel::tool_offset {
namespace {

/// Compares the reference tool's own pairs with their programmed offset: they have no other one.
/// Another tool's programmed offset looks like the tool's own.
/// @returns the reason why the sheet was not printed from this file; nothing if it may have been.
std::optional<std::string> CheckAgainstFile(const SheetPlan& plan, const SheetResult& result) {
  constexpr double kMaxBias_mm = 0.03;  // published method's bias
  constexpr double kSigmas = 4;
  // A pair's "+" and "-" structure are adjacent.
  for (std::size_t i = 0; i + 1 < plan.structures.size(); i += 2) {
    const Structure& plus = plan.structures[i];
    if (plus.combs[0].tool != plan.settings.reference_tool) continue;
    const Measured& first = result.structures[i].offset_mm;
    const Measured& second = result.structures[i + 1].offset_mm;
    if (!first.good() || !second.good()) continue;
    // The tested comb is comb 0 of "+" and comb 1 of "-": a bias by order cancels.
    const double programmed_mm = -Programmed_mm(plus);
    const double offset_mm = (second.quantity().value - first.quantity().value) / 2;
    const double uncertainty_mm =
        std::hypot(first.quantity().standard_uncertainty, second.quantity().standard_uncertainty) /
        2;
    if (std::abs(offset_mm - programmed_mm) < kMaxBias_mm + kSigmas * uncertainty_mm) continue;
    return fmt::format(
        "T{} against itself is moved by {:+.3f} mm along {} on the sheet, by {:+.3f} mm in the "
        "file: the sheet was not printed from this file, so that its other offsets do not count "
        "either. Give the G-code that was printed",
        plan.settings.reference_tool, offset_mm, plus.axis == Axis::kX ? 'u' : 'v', programmed_mm);
  }
  return std::nullopt;
}

/// Properties of each tool before its combs are read.
struct KnownTool {
  bool usable = false;
  std::string why_not;
  InkColour ink;
  SheetPoint shift;
};
using KnownTools = std::map<int, KnownTool>;

/// Lists legs that surely only the reference tool has drawn: the code, or its own combs.
std::vector<Leg> ReferenceLegs(const SheetPlan& plan) {
  std::vector<Leg> legs;
  for (const Structure& structure : plan.structures) {
    if (!plan.original) break;
    const std::size_t comb = structure.swapped ? 0 : 1;
    for (int finger = 0; finger < plan.settings.teeth; ++finger) {
      if (finger == structure.incomplete[comb]) continue;
      for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) legs.push_back(leg);
    }
  }
  for (const CodeCell& cell : plan.code) {
    if (cell.dark) legs.push_back(CodeLeg(plan, cell));
  }
  return legs;
}

/// True if in some structure most lines of the reference tool are off the map.
bool ReferenceLiesElsewhere(const SheetPlan& plan, const InkRaster& raster) {
  constexpr double kFaint = 0.5;  // relative to the strongest lines
  std::vector<double> strength;
  for (const Structure& structure : plan.structures) {
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      if (structure.combs[comb].tool != plan.settings.reference_tool) continue;
      std::vector<Leg> legs;
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        const auto of_finger = FingerLegs(plan, structure, comb, finger);
        legs.insert(legs.end(), of_finger.begin(), of_finger.end());
      }
      strength.push_back(MedianStrength(raster, legs));
    }
  }
  const auto [least, most] = std::minmax_element(strength.begin(), strength.end());
  return *least < std::max(raster.FaintestInk(), kFaint * *most);
}

/// True if a side of the box was found partly along one of its lines, partly along the next. No
/// paper bends as far within a side.
bool SideChangesLine(const SheetPlan& plan, const PageMap& map) {
  if (plan.box_insets_mm.size() < 2) return false;
  const double max_mm = 0.5 * (plan.box_insets_mm[1] - plan.box_insets_mm[0]);
  return std::any_of(map.bend_mm.begin(), map.bend_mm.end(), [&](const auto& cubic) {
    constexpr int kSteps = 10;
    double low_mm = cubic[0];
    double high_mm = cubic[0];
    for (int i = -kSteps; i <= kSteps; ++i) {
      const double t = static_cast<double>(i) / kSteps;
      const double mm = cubic[0] + t * (cubic[1] + t * (cubic[2] + t * cubic[3]));
      low_mm = std::min(low_mm, mm);
      high_mm = std::max(high_mm, mm);
    }
    return high_mm - low_mm > max_mm;
  });
}

std::vector<ToolReading> PlaceTools(const PageView& page, const SheetPlan& plan, const PageMap& map,
                                    const InkRaster& raster, const InkColour& reference) {
  std::vector<int> numbers = plan.settings.tools;
  std::erase(numbers, plan.settings.reference_tool);
  const std::vector<CoarseReading> readings =
      ReadCoarsely(page, map, plan, raster, reference, numbers);
  std::vector<ToolReading> tools(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    tools[i].tool = numbers[i];
    tools[i].coarse_reading = readings[i];
  }
  return tools;
}

KnownTools KnowTools(const SheetPlan& plan, const InkColour& reference,
                     const std::vector<ToolReading>& tools) {
  KnownTools known;
  known[plan.settings.reference_tool] = {true, {}, reference, {}};
  const double reach_mm = FineReach_mm(plan.settings);
  for (const ToolReading& tool : tools) {
    KnownTool& entry = known[tool.tool];
    entry.ink = tool.coarse_reading.ink;
    entry.shift = tool.coarse_reading.shift;
    const SheetPoint& apart = tool.coarse_reading.from_reference;
    const double far_mm = std::max(std::abs(apart.u_mm), std::abs(apart.v_mm));
    if (!tool.coarse_reading.found) {
      entry.why_not = fmt::format("T{} was not found", tool.tool);
    } else if (far_mm > reach_mm) {
      entry.why_not =
          fmt::format("T{} is {:.2f} mm off: beyond {:.2f} mm its teeth come too near those of T{}",
                      tool.tool, far_mm, reach_mm, plan.settings.reference_tool);
    } else {
      entry.usable = true;
    }
  }
  return known;
}

/// Foreign ink inside structures.
struct OtherInk {
  std::vector<ForeignLeg> foreign;
  std::vector<double> stray;  ///< per structure, share of its white
  std::vector<bool> glare;    ///< per structure of a photo; empty for a scan
};

OtherInk FindOtherInk(const SheetPlan& plan, const InkRaster& raster, const InkColour& reference,
                      const std::vector<ToolReading>& tools) {
  std::map<int, SheetPoint> shift{{plan.settings.reference_tool, SheetPoint{}}};
  for (const ToolReading& tool : tools) {
    if (tool.coarse_reading.placed) shift[tool.tool] = tool.coarse_reading.shift;
  }
  return {ForeignLegs(plan, shift, FineReach_mm(plan.settings)),
          StrayInk(raster, plan, shift, Strength(reference)),
          {}};
}

StructureReading ReadOne(const PageView& page, const SheetPlan& plan, const PageMap& map,
                         const KnownTools& known, const OtherInk& other, std::size_t index,
                         const std::optional<PhotoOnPage>& photo) {
  const Structure& structure = plan.structures[index];
  StructureReading reading;
  reading.structure = index;
  reading.name = structure.name;
  if (photo) reading.lever = LeverAt(photo->pose, map, structure.axis, structure.middle);
  std::array<const KnownTool*, 2> tools{};
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const auto found = known.find(structure.combs[comb].tool);
    if (found == known.end() || !found->second.usable) {
      reading.offset_mm = Measured::Refused(
          found == known.end() ? fmt::format("T{} is not on the sheet", structure.combs[comb].tool)
                               : found->second.why_not);
      return reading;
    }
    tools[comb] = &found->second;
  }
  const ChannelChoice choice = ChooseChannels(tools[0]->ink, tools[1]->ink);
  std::array<CombExpectation, 2> expected;
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    expected[comb] = {choice.mix[comb], tools[comb]->shift,
                      fmt::format("T{}", structure.combs[comb].tool)};
    reading.channel[comb] = InkChannelName(choice.channel[comb], page.channels);
    reading.mix[comb] = choice.mix[comb];
    reading.shift_mm[comb] = tools[comb]->shift;
  }
  constexpr double kMaxStray = 0.05;
  if (other.stray[index] > kMaxStray) {
    reading.offset_mm = Measured::Refused(fmt::format(
        "ink that belongs to no line of the sheet lies in {:.0f} % of its white: another tool's, "
        "a hair's or a stain's",
        100 * other.stray[index]));
    return reading;
  }
  if (!other.glare.empty() && other.glare[index]) {
    reading.offset_mm = Measured::Refused(
        "a lamp's reflection drowns lines in it: take the photo again with the sheet or the lamp "
        "turned away");
    return reading;
  }
  auto fingers = ReadStructure(page, map, plan, structure, expected, other.foreign);
  if (!fingers) {
    reading.offset_mm = Measured::Refused(fingers.error().message);
    return reading;
  }
  reading.fingers = std::move(*fingers);
  FitCombs(plan.settings, reading);
  return reading;
}

void CompareResolution(const AnalyseOptions& options, SheetResult& result) {
  const Resolution shown = ShownResolution(result.sheet.map);
  result.page_dpi_x = shown.x;
  result.page_dpi_y = shown.y;
  if (result.photo) return;  // a camera's file states no page resolution
  const auto differs = [](const std::optional<double>& stated, double found) {
    return stated && !(std::abs(*stated / found - 1) < kSameResolution);
  };
  if (!differs(options.dpi_x, result.page_dpi_x) && !differs(options.dpi_y, result.page_dpi_y)) {
    return;
  }
  result.notices.push_back(fmt::format(
      "the scan is said to have {:.0f} x {:.0f} dpi, but its box has {:.0f} x {:.0f} dpi; the box "
      "counts",
      options.dpi_x.value_or(result.page_dpi_x), options.dpi_y.value_or(result.page_dpi_y),
      result.page_dpi_x, result.page_dpi_y));
}

/// Returns the reason why a scan is too coarse, or nothing. Between the two legs of a finger are
/// 0.3 mm of paper. With fewer than four pixels across a leg and its gap a line's place depends on
/// the pixels; with fewer than six so does the distance of both, which determines the backlash on
/// original sheets.
std::optional<std::string> TooCoarse(const SheetPlan& plan, const PageMap& map) {
  constexpr double kScale = 0.97;  // scanner scale, worst case
  const double min_dpi = plan.original ? 200 : 150;
  const double dpi = 25.4 * std::min(Length(map.u_px_mm), Length(map.v_px_mm));
  if (dpi >= kScale * min_dpi) return std::nullopt;
  return fmt::format(
      "the scan shows the sheet with {:.0f} dpi, at least {:.0f} are needed: scan it with 300 dpi "
      "or "
      "more",
      dpi, min_dpi);
}

constexpr const char* kNoOriginalPhoto =
    "a photo of a sheet of the original generator is not read: put it on a scanner, or print a "
    "sheet with trammel offset pattern --for-photo";

/// Returns the kind for messages before the sheet is found: a photo if anything indicates one.
PageKind LikelyKind(const PageView& page, const SheetPlan& plan, const AnalyseOptions& options) {
  if (options.kind) return *options.kind;
  const bool stated = options.dpi_x.has_value() || plan.original;
  const bool camera = options.photo.film_focal_mm || IsStoredSize(page.width, page.height);
  return camera && !stated ? PageKind::kPhoto : PageKind::kScan;
}

/// Finds the sheet on the page, and whether it is a scan or a photo.
Result<PageKind> FindSheetAndKind(const PageView& page, const SheetPlan& plan,
                                  const AnalyseOptions& options, SheetOnPage& found) {
  if (options.kind == PageKind::kPhoto && plan.original) return Fail(kNoOriginalPhoto);
  auto sheet = TRY(FindSheet(page, plan, LikelyKind(page, plan, options)));
  found = std::move(sheet);
  if (options.kind) return *options.kind;
  const StatedOfPage stated{options.dpi_x, options.dpi_y, options.photo.film_focal_mm.has_value()};
  const KindSigns signs = SignsOf(page, found.map, stated);
  const auto kind = KindBy(signs, stated, plan.settings.for_photo);
  if (!kind) return Fail(WhyNoKind(signs), ErrorKind::kMeasurement);
  if (*kind == PageKind::kPhoto && plan.original) {
    return Fail(kNoOriginalPhoto, ErrorKind::kMeasurement);
  }
  return *kind;
}

/// Determines the photo's geometry, and the sheet's map.
Result<PhotoOnPage> ReadPhoto(const PageView& page, const SheetPlan& plan,
                              const PhotoSource& source, SheetOnPage& sheet) {
  const double blur_px = BlurOfBox_px(page, plan, sheet);
  auto photo = FitPhotoMap(page, plan, source, sheet);
  if (!photo && blur_px <= kMaxPhotoBlur_px) return photo;
  PhotoOnPage seen = photo.value_or(PhotoOnPage{});
  if (!photo) seen.px_per_mm = kMinPhotoScale_px_mm;
  seen.blur_px = blur_px;
  if (const auto fault = PhotoFault(seen)) return Fail(*fault, ErrorKind::kMeasurement);
  return seen;
}

}  // namespace

Result<SheetResult> AnalyseSheet(const PageView& page, const SheetPlan& plan,
                                 const AnalyseOptions& options) {
  /// Search range for a tool beside the box, and half of a leg more.
  constexpr double kAround_mm = kSearch_mm + 5;
  SheetResult result;
  const auto kind = TRY(FindSheetAndKind(page, plan, options, result.sheet));
  if (kind == PageKind::kPhoto) {
    auto photo = TRY(ReadPhoto(page, plan, options.photo, result.sheet));
    result.photo = photo;
  } else if (const auto why = TooCoarse(plan, result.sheet.map)) {
    return Fail(*why, ErrorKind::kMeasurement);
  }
  const PageMap& map = result.sheet.map;
  const std::vector<Leg> reference_legs = ReferenceLegs(plan);
  const InkColour reference = SampleInk(page, map, plan.settings, reference_legs);
  const InkRaster raster = TakeInkRaster(page, map, kAround_mm);
  if (result.sheet.box_lacks_line &&
      (SideChangesLine(plan, map) || ReferenceLiesElsewhere(plan, raster))) {
    return Fail(fmt::format("a side of the box has lost one of its {} lines, and the others do not "
                            "tell where the sheet lies: look why lines of T{} do not stick or "
                            "break off (nozzle height, flow, clean paper), and print the sheet "
                            "again",
                            plan.box_insets_mm.size(), plan.settings.reference_tool),
                ErrorKind::kMeasurement);
  }
  if (!IsReadable(reference)) {
    return Fail(fmt::format("T{}, the reference tool: {}", plan.settings.reference_tool,
                            WhyUnreadable(reference, MedianStrength(raster, reference_legs))),
                ErrorKind::kMeasurement);
  }
  result.reference_strength = Strength(reference);
  result.tools = PlaceTools(page, plan, map, raster, reference);
  const KnownTools known = KnowTools(plan, reference, result.tools);
  OtherInk other = FindOtherInk(plan, raster, reference, result.tools);
  if (result.photo) other.glare = GlareOver(page, plan, map);
  result.structures.resize(plan.structures.size());
  ParallelFor(static_cast<int>(plan.structures.size()), [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    result.structures[index] = ReadOne(page, plan, map, known, other, index, result.photo);
  });
  result.notices = plan.notices;
  for (std::size_t i = 0; i < other.glare.size(); ++i) {
    if (!other.glare[i]) continue;
    result.notices.push_back(fmt::format(
        "a lamp's reflection lies over {}, which does not count: the intervals are wider for it",
        plan.structures[i].name));
  }
  if (plan.original && map.mirrored()) {
    result.notices.emplace_back(
        "the page shows the print mirrored, by the scanner's driver or because an axis of the "
        "machine runs backwards: it is read as it was drawn, and the signs are the print's own");
  }
  EstimateOffsets(plan, result);
  if (plan.original) {
    if (const auto why = CheckAgainstFile(plan, result)) return Fail(*why, ErrorKind::kMeasurement);
  }
  CompareResolution(options, result);
  return result;
}

SheetResult JoinPhotos(const SheetPlan& plan, std::span<const SheetResult> photos) {
  TRAMMEL_CHECK(!photos.empty(), "no photo");
  std::vector<const std::vector<StructureReading>*> structures;
  SheetResult joined = photos.front();
  joined.pick_ups.clear();
  joined.self_tests.clear();
  joined.notices = plan.notices;
  PhotoPose& pose = joined.photo->pose;
  pose.foot = pose.aim = {};
  for (const SheetResult& photo : photos) {
    TRAMMEL_CHECK(photo.photo && photo.structures.size() == plan.structures.size(), "{} structures",
                  photo.structures.size());
    structures.push_back(&photo.structures);
    pose.as_stored = pose.as_stored && photo.photo->pose.as_stored;
    pose.centre_uncertainty_px =
        std::max(pose.centre_uncertainty_px, photo.photo->pose.centre_uncertainty_px);
    pose.focal_uncertainty = std::max(pose.focal_uncertainty, photo.photo->pose.focal_uncertainty);
    const double part = 1 / static_cast<double>(photos.size());
    pose.foot.u_mm += part * photo.photo->pose.foot.u_mm;
    pose.foot.v_mm += part * photo.photo->pose.foot.v_mm;
    pose.aim.u_mm += part * photo.photo->pose.aim.u_mm;
    pose.aim.v_mm += part * photo.photo->pose.aim.v_mm;
  }
  const SheetModel model(plan, structures, joined.photo->spread);
  EstimateOffsets(plan, model, joined);
  return joined;
}

}  // namespace trammel::tool_offset
