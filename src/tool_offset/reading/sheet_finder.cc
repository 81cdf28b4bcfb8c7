#include "tool_offset/reading/sheet_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "tool_offset/reading/box_candidates.h"
#include "tool_offset/reading/box_start.h"
#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::tool_offset {
namespace {

/// Returns the maximum ink along v within a line's width near the cell's middle, above the paper
/// beside.
double LegInk(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
              const LocalMap& local) {
  constexpr double kRowHalf_mm = 1.2;  // of the leg's 4 mm
  constexpr double kRowStep_mm = 0.1;
  constexpr double kHalf_mm = 0.9;  // of the cell's 2 mm
  Strip strip;
  const double step_mm = 1 / Length(local.u_px_mm);
  strip.rows = static_cast<int>(2 * kRowHalf_mm / kRowStep_mm) + 1;
  strip.columns = static_cast<int>(2 * kHalf_mm / step_mm) + 1;
  strip.row_step = kRowStep_mm * local.v_px_mm;
  strip.column_step = step_mm * local.u_px_mm;
  strip.origin = local.ToPage({-kHalf_mm, -kRowHalf_mm});
  std::vector<float> samples;
  if (!SampleStrip(page, mix, strip, samples)) return 0;
  const auto columns = static_cast<std::size_t>(strip.columns);
  std::vector<float> profile(columns, 0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    profile[i % columns] += samples[i] / static_cast<float>(strip.rows);
  }
  const auto width = std::clamp<std::size_t>(
      static_cast<std::size_t>(plan.settings.line_width_mm / step_mm), 1, columns);
  double most = -1e9;
  for (std::size_t first = 0; first + width <= columns; ++first) {
    const double sum =
        std::accumulate(profile.begin() + static_cast<std::ptrdiff_t>(first),
                        profile.begin() + static_cast<std::ptrdiff_t>(first + width), 0.0);
    most = std::max(most, sum / static_cast<double>(width));
  }
  const auto middle = profile.begin() + static_cast<std::ptrdiff_t>(columns / 2);
  std::nth_element(profile.begin(), middle, profile.end());
  return most - static_cast<double>(*middle);
}

int MissingCells(const CodeReading& code, const SheetPlan& plan) {
  int missing = 0;
  for (std::size_t i = 0; i < plan.code.size(); ++i) {
    missing += plan.code[i].dark && !code.dark[i] ? 1 : 0;
  }
  return missing;
}

}  // namespace

CodeReading ReadCode(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
                     const PageMap& map) {
  constexpr std::size_t kSure = 5;  // every code has more dark and light cells than this
  CodeReading reading;
  for (const CodeCell& cell : plan.code) {
    reading.ink.push_back(LegInk(page, mix, plan, map.Near(cell.middle)));
  }
  std::vector<double> sorted = reading.ink;
  if (sorted.size() < 2 * kSure) return reading;
  std::sort(sorted.begin(), sorted.end());
  const double light = sorted[kSure / 2];
  const double dark = sorted[sorted.size() - 1 - kSure / 2];
  reading.contrast = dark - light;
  CodeCells cells{};
  for (std::size_t i = 0; i < reading.ink.size(); ++i) {
    reading.dark.push_back(reading.ink[i] > (light + dark) / 2);
    if (reading.dark[i] != plan.code[i].dark) ++reading.wrong_cells;
    if (i < cells.size()) cells[i] = reading.dark[i];
  }
  if (plan.code.size() == kCodeCells) {
    if (const auto id = DecodeSheetId(cells)) reading.sheet_id = *id;
  }
  return reading;
}

bool IsThisCode(const CodeReading& code, const SheetPlan& plan) {
  constexpr int kDamaged = 2;           // cells, when all the others say that it is this sheet
  constexpr int kBroken = 4;            // dark cells of 34 whose lines did not stick, none added
  constexpr int kMissing = 1;           // dark cells of 34 that may have lost their ink
  constexpr double kPrintedOver = 0.7;  // share of the light ones
  if (code.wrong_cells <= kDamaged) return true;
  const auto light = std::count_if(plan.code.begin(), plan.code.end(),
                                   [](const CodeCell& cell) { return !cell.dark; });
  const int missing = MissingCells(code, plan);
  const int added = code.wrong_cells - missing;
  if (added == 0) return missing <= kBroken;
  return missing <= kMissing && added <= kPrintedOver * static_cast<double>(light);
}

bool IsBrokenCode(const CodeReading& code, const SheetPlan& plan) {
  constexpr int kFewest = 8;  // dark cells that chance finds among the plan's once in 256 times
  const int missing = MissingCells(code, plan);
  const auto dark = std::count(code.dark.begin(), code.dark.end(), true);
  return missing == code.wrong_cells && dark >= kFewest;
}

namespace {

/// Identification of a rectangle of lines, in order of information.
enum class Finding {
  kNothing,
  kPart,
  kOtherShape,  ///< original sheets only, like kNoWayRound
  kNoWayRound,
  kUnreadable,
  kBroken,
  kMerged,
  kOther,
  kMirrored,
  kSheet
};

struct Attempt {
  Finding finding = Finding::kNothing;
  SheetOnPage sheet;
  std::uint16_t other_id = 0;
  double line_width_mm = 0;  ///< width of merged box lines
  int missing_cells = 0;     ///< code cells that lost their lines
};

/// Reads the code in all four orientations that a found box allows.
Attempt ReadBox(const PageView& page, const SheetPlan& plan, const BoxFit& box,
                const ChannelMix& mix) {
  constexpr double kFaintestCode = 0.3;
  Attempt best;
  best.finding = Finding::kUnreadable;
  int fewest_wrong = static_cast<int>(plan.code.size());
  for (const bool flip_u : {false, true}) {
    for (const bool flip_v : {false, true}) {
      SheetOnPage sheet;
      sheet.map = Turned(box.map, flip_u, flip_v);
      sheet.box_places = Turned(box.places, flip_u, flip_v);
      sheet.box_rms_mm = box.rms_mm;
      sheet.box_lacks_line = *std::min_element(box.whole.begin(), box.whole.end()) < 0.5;
      sheet.reference_mix = mix;
      sheet.code = ReadCode(page, mix, plan, sheet.map);
      if (sheet.code.contrast < kFaintestCode) continue;
      const bool mirrored = sheet.map.mirrored();
      if (sheet.code.sheet_id && *sheet.code.sheet_id != plan.sheet_id) {
        if (best.finding > Finding::kOther) continue;
        best.finding = mirrored ? Finding::kMirrored : Finding::kOther;
        best.other_id = *sheet.code.sheet_id;
      } else if (IsThisCode(sheet.code, plan) && sheet.code.wrong_cells < fewest_wrong) {
        fewest_wrong = sheet.code.wrong_cells;
        best.finding = mirrored ? Finding::kMirrored : Finding::kSheet;
        best.sheet = sheet;
      } else if (IsBrokenCode(sheet.code, plan) && best.finding < Finding::kBroken) {
        best.finding = Finding::kBroken;
        best.missing_cells = sheet.code.wrong_cells;
      }
    }
  }
  return best;
}

/// Returns the part of the plan known for a sheet of unknown size: its box, and the code in the
/// same corner.
/// @param width_mm, height_mm  of the box.
SheetPlan PlanOfSize(const SheetPlan& plan, double width_mm, double height_mm) {
  SheetPlan other;
  other.settings = plan.settings;
  other.box_insets_mm = plan.box_insets_mm;
  other.code = plan.code;
  other.sheet_id = plan.sheet_id;
  other.width_mm = width_mm;
  other.height_mm = height_mm;
  for (CodeCell& cell : other.code) {
    cell.middle.u_mm -= (width_mm - plan.width_mm) / 2;
    cell.middle.v_mm -= (height_mm - plan.height_mm) / 2;
  }
  return other;
}

/// Reads the code in a box of another plan; the distance of the box's lines determines the scale.
Attempt TryOtherSheet(const PageView& page, const SmallPage& small, const SheetPlan& plan,
                      const BoxCandidate& candidate, const ChannelMix& mix) {
  constexpr double kShortest_mm = 40;  // sides that a sheet may have
  constexpr double kLongest_mm = 500;
  Attempt best;
  if (plan.box_insets_mm.size() < 2) return best;
  std::array<PagePoint, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    corners[i] = small.OnPage(candidate.corners[i].x_px, candidate.corners[i].y_px);
  }
  const double length_px = candidate.length() * small.factor;
  const double width_px = candidate.width() * small.factor;
  const double spacing_mm = plan.box_insets_mm[1];
  const auto spacing_px = LineSpacing_px(page, mix, corners, 3.0 * small.factor,
                                         spacing_mm * std::max(length_px, width_px) / kLongest_mm,
                                         spacing_mm * std::min(length_px, width_px) / kShortest_mm);
  if (!spacing_px) return best;
  const double px_per_mm = *spacing_px / spacing_mm;
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    const SheetPlan other = PlanOfSize(plan, (side == 0 ? length_px : width_px) / px_per_mm,
                                       (side == 0 ? width_px : length_px) / px_per_mm);
    const auto start = StartMap(small, candidate, side, other);
    if (!start) continue;
    const BoxFit box = FitBox(page, mix, other, *start);
    if (*std::min_element(box.support.begin(), box.support.end()) < kSideFound) continue;
    Attempt attempt = ReadBox(page, other, box, mix);
    // The other plan shares only the cells' size.
    if (attempt.finding == Finding::kBroken || attempt.finding == Finding::kSheet) continue;
    if (attempt.finding > best.finding) best = std::move(attempt);
  }
  return best;
}

Attempt TryCandidate(const PageView& page, const SmallPage& small, const SheetPlan& plan,
                     const BoxCandidate& candidate, int threshold) {
  Attempt best;
  const ChannelMix mix = MixOfSides(small, candidate, threshold);
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    const auto start = StartMap(small, candidate, side, plan);
    if (!start) continue;
    const double ratio = Length(start->u_px_mm) / Length(start->v_px_mm);
    if (std::abs(std::log(ratio)) > kSlantedAnisotropy) continue;
    const BoxFit box = FitBox(page, mix, plan, *start);
    const bool found = *std::min_element(box.support.begin(), box.support.end()) >= kSideFound;
    Attempt attempt = found ? ReadBox(page, plan, box, mix) : Attempt{};
    if (attempt.finding <= Finding::kBroken) {
      if (const auto merged = MergedLineWidth_mm(page, mix, plan, *start)) {
        attempt.finding = Finding::kMerged;
        attempt.line_width_mm = *merged;
      }
    }
    if (attempt.finding <= best.finding) continue;
    best = std::move(attempt);
  }
  if (best.finding <= Finding::kMerged) {
    Attempt other = TryOtherSheet(page, small, plan, candidate, mix);
    if (other.finding > best.finding) best = std::move(other);
  }
  return best;
}

/// Tries all orientations that the box of an original sheet allows: it has no mark of its
/// orientation, and a mirrored page is read as it was drawn.
Attempt TryOriginal(const PageView& page, const SmallPage& small, const SheetPlan& plan,
                    const BoxCandidate& candidate, int threshold) {
  constexpr double kMinMatch = 0.45;
  constexpr double kMinLead = 0.25;  // a wrong way round has single legs under its own
  const SheetPlan bar = BarOf(plan);
  const ChannelMix mix = MixOfSides(small, candidate, threshold);
  Attempt attempt;
  double best = -1e9;
  double second = -1e9;
  bool other_shape = !candidate.straightened;
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    const auto start = StartMap(small, candidate, side, bar);
    if (!start) continue;
    const double ratio = Length(start->u_px_mm) / Length(start->v_px_mm);
    if (std::abs(std::log(ratio)) > kAnisotropy) continue;
    other_shape = false;
    const BoxFit box = FitBox(page, mix, bar, *start);
    if (*std::min_element(box.support.begin(), box.support.end()) < kSideFound) continue;
    for (const bool flip_u : {false, true}) {
      for (const bool flip_v : {false, true}) {
        const PageMap map = Turned(box.map, flip_u, flip_v);
        const double match = ReferenceMatch(page, plan, mix, map);
        second = std::max(second, std::min(best, match));
        if (match <= best) continue;
        best = match;
        attempt.sheet.map = map;
        attempt.sheet.box_places = Turned(box.places, flip_u, flip_v);
        attempt.sheet.box_rms_mm = box.rms_mm;
      }
    }
  }
  if (best == -1e9) {
    attempt.finding = other_shape ? Finding::kOtherShape : Finding::kNothing;
    return attempt;
  }
  const bool sure = best >= kMinMatch && best >= second + kMinLead;
  attempt.finding = sure ? Finding::kSheet : Finding::kNoWayRound;
  attempt.sheet.reference_mix = mix;
  return attempt;
}

/// Search results for one threshold.
struct Search {
  Attempt best;
  int sheets = 0;  ///< readable sheets, this one or others
};

Search SearchAt(const PageView& page, const SmallPage& small, const SheetPlan& plan, int threshold,
                bool widened) {
  constexpr double kPart = 0.25;  // of the page's longer side, for a truncated box
  constexpr int kMaxTried = 20;   // a page full of frames is no sheet
  Search search;
  int tried = 0;
  std::vector<BoxCandidate> read;
  for (const BoxCandidate& candidate : FindBoxCandidates(small, threshold, widened)) {
    const bool known = std::any_of(read.begin(), read.end(), [&](const BoxCandidate& outer) {
      return Overlap(candidate, outer);
    });
    if (known) continue;
    Attempt attempt;
    if (candidate.sides() == 4 && ++tried <= kMaxTried) {
      attempt =
          (plan.original ? TryOriginal : TryCandidate)(page, small, plan, candidate, threshold);
      for (std::size_t i = 0; i < 4; ++i) {
        attempt.sheet.corners[i] =
            small.OnPage(candidate.corners[i].x_px, candidate.corners[i].y_px);
      }
      if (attempt.finding >= Finding::kOther) {
        ++search.sheets;
        read.push_back(candidate);
      }
    }
    const bool whole = candidate.sides() == 4 && !candidate.straightened;
    const bool large = std::max(candidate.length(), candidate.width()) >
                       kPart * std::max(small.width, small.height);
    if (attempt.finding == Finding::kNothing && !whole && candidate.sides() >= 2 && large) {
      attempt.finding = Finding::kPart;
    }
    if (attempt.finding > search.best.finding) search.best = std::move(attempt);
  }
  return search;
}

/// Returns the advice that differs from a scan's; empty without a difference.
std::string WhatToDoWithPhoto(const Attempt& attempt, const SheetPlan& plan) {
  switch (attempt.finding) {
    case Finding::kMirrored:
      return "the photo is mirrored: the sheet's code reads only from behind. Take it with the "
             "camera on the phone's back, of the printed side; a mirrored picture would turn the "
             "signs of the offsets round";
    case Finding::kMerged:
      return "the lines of the box run together: the photo is blurred or too coarse, or they were "
             "printed too wide. Let the sheet fill the picture, hold the phone still, and further "
             "away if it cannot focus";
    case Finding::kBroken:
      return fmt::format(
          "{} lines of the sheet's code are missing in the photo, too many to tell its number: a "
          "lamp's reflection or something else covers them, or they do not stick. Take it again in "
          "even light, or print the sheet again",
          attempt.missing_cells);
    case Finding::kPart:
      return fmt::format(
          "only a part of a box was found: the whole sheet, {:.0f} x {:.0f} mm with all four sides "
          "of its box, must be in the picture, sharp and uncovered, without a lamp's reflection, "
          "by "
          "the main or the 2x camera, not the ultra-wide one, which bends straight lines",
          plan.width_mm, plan.height_mm);
    case Finding::kNothing:
      return fmt::format(
          "no printed sheet was found in the photo: no closed box of {:.0f} x {:.0f} mm. Let the "
          "whole sheet fill the picture, flat, sharp and seen from nearly straight above, by the "
          "main or the 2x camera, not the ultra-wide one, which bends straight lines",
          plan.width_mm, plan.height_mm);
    default:
      return {};
  }
}

std::string WhatToDo(const Attempt& attempt, const SheetPlan& plan, PageKind kind) {
  if (kind == PageKind::kPhoto) {
    if (std::string text = WhatToDoWithPhoto(attempt, plan); !text.empty()) return text;
  }
  switch (attempt.finding) {
    case Finding::kMirrored:
      return "the scan is mirrored: the sheet's code reads only from behind. Switch off mirroring "
             "in "
             "the scanner's driver, or scan the printed side; a mirrored picture would turn the "
             "signs of the offsets round";
    case Finding::kOther:
      return fmt::format(
          "the page shows sheet {}, but the pattern file describes sheet {}: give the pattern file "
          "that this sheet was printed from",
          attempt.other_id, plan.sheet_id);
    case Finding::kUnreadable:
      return fmt::format(
          "a box was found, but no code of {} cells inside it could be read: check that the sheet "
          "was printed from this pattern file (sheet {}), that its lines stuck, and that nothing "
          "covers its corner",
          plan.code.size(), plan.sheet_id);
    case Finding::kMerged:
      return fmt::format(
          "the lines of the box have run together: they are about {:.2f} mm wide, {} mm were "
          "planned. Lower the flow or raise the nozzle (paper_thickness), and print the sheet "
          "again",
          attempt.line_width_mm, plan.settings.line_width_mm);
    case Finding::kBroken:
      return fmt::format(
          "{} lines of the sheet's code are missing, too many to tell its number: look why its "
          "lines do not stick or break off (nozzle height, flow, clean paper), and print it again",
          attempt.missing_cells);
    case Finding::kNoWayRound:
      return fmt::format(
          "a box was found, but whichever way round, the lines of T{} are not where an original "
          "sheet of {} pairs has them: check that it is the sheet of this file, and that all lines "
          "of T{} stuck",
          plan.settings.reference_tool, plan.structures.size() / 4, plan.settings.reference_tool);
    case Finding::kOtherShape:
      return fmt::format(
          "the box on the page has not the shape of {:.0f} x {:.0f} mm, as that of {} pairs has: "
          "check that it is the sheet of this file",
          plan.width_mm, plan.height_mm, plan.structures.size() / 4);
    case Finding::kPart:
      return fmt::format(
          "only a part of a box was found: the whole sheet, {:.0f} x {:.0f} mm with all four sides "
          "of its box, must be on the scan, unbroken and seen from straight above",
          plan.width_mm, plan.height_mm);
    case Finding::kNothing:
    case Finding::kSheet:
      break;
  }
  return fmt::format(
      "no printed sheet was found on the page: no closed box of {:.0f} x {:.0f} mm. Put the sheet "
      "on the glass with its printed side down and scan at 300 dpi or more",
      plan.width_mm, plan.height_mm);
}

}  // namespace

Result<SheetOnPage> FindSheet(const PageView& page, const SheetPlan& plan, PageKind kind) {
  constexpr std::array<double, 3> kThresholds{0.45, 0.25, 0.12};  // relative to ink strength
  constexpr int kLowest = 8;
  constexpr int kFaint = 16;
  TRY(CheckPage(page));
  const SmallPage small = Shrink(page);
  const int strength = InkStrength(small);
  Attempt best;
  for (const bool widened : {false, true}) {
    int last_threshold = 256;
    for (const double part : kThresholds) {
      const int threshold = std::max(kLowest, static_cast<int>(part * strength));
      if (threshold >= last_threshold || best.finding >= Finding::kOther) break;
      last_threshold = threshold;
      Search search = SearchAt(page, small, plan, threshold, widened);
      if (search.sheets > 1) {
        return Fail(
            fmt::format("{} sheets were found on the page: scan one at a time", search.sheets),
            ErrorKind::kMeasurement);
      }
      if (search.best.finding > best.finding) best = std::move(search.best);
    }
  }
  if (best.finding == Finding::kSheet) {
    const PagePoint u = best.sheet.map.u_px_mm;
    best.sheet.angle_rad = std::atan2(-u.y_px, u.x_px);
    return std::move(best.sheet);
  }
  if (best.finding == Finding::kNothing && strength <= kFaint) {
    return Fail(
        fmt::format("no printed sheet was found: nothing on the page stands out by more than {} of "
                    "255 levels: "
                    "the page is empty, or the print too faint; use a colour that stands out",
                    strength),
        ErrorKind::kMeasurement);
  }
  return Fail(WhatToDo(best, plan, kind), ErrorKind::kMeasurement);
}

}  // namespace trammel::tool_offset
