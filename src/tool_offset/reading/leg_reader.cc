#include "tool_offset/reading/leg_reader.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/statistics.h"
#include "tool_offset/reading/page.h"

namespace trammel::tool_offset {
namespace {

/// Range of paper beside a finger: far enough for blur and shadow, near enough for the same light.
constexpr double kPaperFrom_mm = 0.15;
constexpr double kPaperTo_mm = 0.45;
/// Maximum distance of a finger from its located position.
constexpr double kMaxOff_mm = 0.1;
/// Minimum row height: finer rows have no more information on a line.
constexpr double kFinestRow_mm = 0.02;

double HalfFinger_mm(const SheetSettings& settings) {
  return (settings.leg_spacing_mm + settings.line_width_mm) / 2;
}

/// Strip across both legs, with the size of its rows and columns in mm.
struct FingerStrip {
  Strip strip;
  double column_mm = 1;
  double row_mm = 1;
  double half_mm = 0;  ///< columns run from -half_mm to half_mm
  double low_mm = 0;   ///< rows begin here

  [[nodiscard]] double Column(double across_mm) const { return (across_mm + half_mm) / column_mm; }
};

FingerStrip LayStrip(const PageMap& map, const FingerSite& site, double half_mm, double low_mm,
                     double high_mm) {
  const LocalMap local = map.Near(site.middle);
  const PagePoint across = site.axis == Axis::kX ? local.u_px_mm : local.v_px_mm;
  const PagePoint along = site.axis == Axis::kX ? local.v_px_mm : local.u_px_mm;
  FingerStrip finger;
  finger.column_mm = 1 / Length(across);
  finger.row_mm = std::max(kFinestRow_mm, 1 / Length(along));
  const double half_columns = std::ceil(half_mm / finger.column_mm);
  finger.half_mm = half_columns * finger.column_mm;
  finger.low_mm = low_mm;
  finger.strip.columns = 2 * static_cast<int>(half_columns) + 1;
  finger.strip.rows = static_cast<int>((high_mm - low_mm) / finger.row_mm) + 1;
  finger.strip.column_step = finger.column_mm * across;
  finger.strip.row_step = finger.row_mm * along;
  finger.strip.origin = local.at - half_columns * finger.strip.column_step + low_mm * along;
  return finger;
}

/// Computes the median of the samples between two positions across, in some rows.
double PaperLevel(const FingerStrip& finger, const std::vector<float>& samples, double from_mm,
                  double to_mm, int first_row, int last_row, std::vector<float>& scratch) {
  const int first = std::max(0, static_cast<int>(std::lround(finger.Column(from_mm))));
  const int last =
      std::min(finger.strip.columns - 1, static_cast<int>(std::lround(finger.Column(to_mm))));
  scratch.clear();
  for (int r = first_row; r <= last_row; ++r) {
    const auto row = samples.begin() + static_cast<std::ptrdiff_t>(r) * finger.strip.columns;
    scratch.insert(scratch.end(), row + first, row + last + 1);
  }
  if (scratch.empty()) return 0;
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return static_cast<double>(*middle);
}

/// Subtracts the paper's level, with its slope across, from all samples.
void SubtractPaper(const FingerStrip& finger, const SheetSettings& settings, const FingerSite& site,
                   ReaderWorkspace& workspace) {
  const auto row_of = [&](double along_mm) {
    const double row = std::round((along_mm - finger.low_mm) / finger.row_mm);
    return static_cast<int>(std::clamp(row, 0.0, finger.strip.rows - 1.0));
  };
  const int first = row_of(site.clear_low_mm);
  const int last = row_of(site.clear_high_mm);
  const double from_mm = HalfFinger_mm(settings) + kPaperFrom_mm;
  const double to_mm = HalfFinger_mm(settings) + kPaperTo_mm;
  const double lower =
      PaperLevel(finger, workspace.samples, -to_mm, -from_mm, first, last, workspace.profile);
  const double upper =
      PaperLevel(finger, workspace.samples, from_mm, to_mm, first, last, workspace.profile);
  const double slope_per_column = (upper - lower) / (from_mm + to_mm) * finger.column_mm;
  const auto columns = static_cast<std::size_t>(finger.strip.columns);
  workspace.profile.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    const double from_middle = static_cast<double>(c) - (static_cast<double>(columns) - 1) / 2;
    workspace.profile[c] = static_cast<float>((upper + lower) / 2 + slope_per_column * from_middle);
  }
  for (std::size_t i = 0; i < workspace.samples.size(); i += columns) {
    for (std::size_t c = 0; c < columns; ++c) workspace.samples[i + c] -= workspace.profile[c];
  }
}

/// Fits a straight line with Tukey's weights: zero for rows far off.
LegReading FitRows(const ReaderWorkspace& workspace, double column_mm,
                   std::vector<double>& scratch) {
  constexpr double kTukey = 4.685;
  constexpr double kFinest_mm = 1e-4;  // the same digit in all rows of a drawn page
  const std::vector<double>& x = workspace.along_mm;
  const std::vector<double>& y = workspace.place_mm;
  LegReading leg;
  if (x.size() < 3) return leg;
  leg.position_mm = Median(y);
  double reach_mm = 0;
  for (int pass = 0; pass < 6; ++pass) {
    scratch.clear();
    for (std::size_t i = 0; i < x.size(); ++i) {
      scratch.push_back(std::abs(y[i] - leg.position_mm - leg.slope * x[i]));
    }
    const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
    std::nth_element(scratch.begin(), middle, scratch.end());
    leg.scatter_mm = 1.4826 * *middle;
    reach_mm = kTukey * std::max(leg.scatter_mm, std::max(kFinest_mm, 0.02 * column_mm));
    double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
    leg.rows_used = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double r = (y[i] - leg.position_mm - leg.slope * x[i]) / reach_mm;
      if (std::abs(r) >= 1) continue;
      const double weight = (1 - r * r) * (1 - r * r);
      ++leg.rows_used;
      w += weight;
      wx += weight * x[i];
      wy += weight * y[i];
      wxx += weight * x[i] * x[i];
      wxy += weight * x[i] * y[i];
    }
    const double determinant = w * wxx - wx * wx;
    if (leg.rows_used < 3 || !(determinant > 1e-12 * w * wxx)) {
      leg.rows_used = 0;
      return leg;
    }
    leg.slope = (w * wxy - wx * wy) / determinant;
    leg.position_mm = (wy - leg.slope * wx) / w;
  }
  return leg;
}

/// @param upper      which of the two legs
/// @param middle_mm  of the finger
LegReading ReadLeg(const FingerStrip& finger, const SheetSettings& settings, const FingerSite& site,
                   bool upper, double middle_mm, ReaderWorkspace& workspace) {
  constexpr double kThinner = 0.6;  // of the leg's median ink: below, the row is broken
  constexpr double kThicker = 1.4;  // or blotted
  const auto columns = static_cast<std::size_t>(finger.strip.columns);
  const double half_mm = settings.leg_spacing_mm / 2;
  const double leg_mm = middle_mm + (upper ? half_mm : -half_mm);
  const double free_mm = upper ? site.free_high_mm : site.free_low_mm;
  workspace.along_mm.clear();
  workspace.place_mm.clear();
  workspace.ink.clear();
  for (int r = 0; r < finger.strip.rows; ++r) {
    const std::span<const float> row(
        workspace.samples.data() + static_cast<std::size_t>(r) * columns, columns);
    const double along_mm = finger.low_mm + r * finger.row_mm;
    const bool clear = along_mm >= site.clear_low_mm && along_mm <= site.clear_high_mm;
    const double outer_mm = clear ? half_mm : free_mm;
    const auto place = HalfInkPlace(row, finger.Column(leg_mm - (upper ? half_mm : outer_mm)),
                                    finger.Column(leg_mm + (upper ? outer_mm : half_mm)));
    if (!place) continue;
    workspace.along_mm.push_back(along_mm);
    workspace.place_mm.push_back(place->middle * finger.column_mm - finger.half_mm);
    workspace.ink.push_back(place->ink);
  }
  LegReading leg;
  leg.rows = finger.strip.rows;
  if (workspace.ink.empty()) return leg;
  const double ink = Median(workspace.ink);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < workspace.ink.size(); ++i) {
    if (workspace.ink[i] < kThinner * ink || workspace.ink[i] > kThicker * ink) continue;
    workspace.along_mm[kept] = workspace.along_mm[i];
    workspace.place_mm[kept++] = workspace.place_mm[i];
  }
  workspace.along_mm.resize(kept);
  workspace.place_mm.resize(kept);
  leg = FitRows(workspace, finger.column_mm, workspace.scratch);
  leg.rows = finger.strip.rows;
  leg.ink_mm = ink * finger.column_mm;
  return leg;
}

}  // namespace

std::optional<double> LocateFinger(const PageView& page, const ChannelMix& mix, const PageMap& map,
                                   const SheetSettings& settings, const FingerSite& site,
                                   double reach_mm, ReaderWorkspace& workspace) {
  constexpr double kFaintest = 0.3;  // relative to the tool's ink
  constexpr double kFlank_mm = 0.2;
  const double half_leg_mm = settings.line_width_mm / 2;
  const double half_finger_mm = HalfFinger_mm(settings);
  const FingerStrip finger = LayStrip(map, site, reach_mm + half_finger_mm + kFlank_mm,
                                      site.clear_low_mm, site.clear_high_mm);
  if (!SampleStrip(page, mix, finger.strip, workspace.samples)) return std::nullopt;
  // Sums of all columns below each.
  const auto columns = static_cast<std::size_t>(finger.strip.columns);
  workspace.profile.assign(columns + 1, 0);
  for (std::size_t i = 0; i < workspace.samples.size(); ++i) {
    workspace.profile[i % columns + 1] +=
        workspace.samples[i] / static_cast<float>(finger.strip.rows);
  }
  for (std::size_t c = 0; c < columns; ++c) workspace.profile[c + 1] += workspace.profile[c];
  const auto mean = [&](double from_mm, double to_mm) {
    const auto column = [&](double across_mm) {
      return static_cast<std::size_t>(std::clamp(std::round(finger.Column(across_mm) + 0.5), 0.0,
                                                 static_cast<double>(columns)));
    };
    const std::size_t first = column(from_mm);
    const std::size_t last = std::max(first + 1, column(to_mm));
    if (last > columns) return 0.0;
    return static_cast<double>(workspace.profile[last] - workspace.profile[first]) /
           static_cast<double>(last - first);
  };
  // Quarter of the gap between the legs on each side of its middle.
  const double gap_mm = std::max(0.0, settings.leg_spacing_mm - settings.line_width_mm) / 4;
  const auto score = [&](double shift_mm) {
    double sum = -mean(shift_mm - gap_mm, shift_mm + gap_mm) / 2;
    for (const int side : {-1, 1}) {
      const double leg_mm = shift_mm + side * settings.leg_spacing_mm / 2;
      const double outer_mm = shift_mm + side * (half_finger_mm + kFlank_mm / 2);
      sum += mean(leg_mm - half_leg_mm, leg_mm + half_leg_mm) / 2 -
             mean(outer_mm - kFlank_mm / 2, outer_mm + kFlank_mm / 2) / 4;
    }
    return sum;
  };
  double best = kFaintest;
  std::optional<double> best_mm;
  for (double shift_mm = -reach_mm; shift_mm <= reach_mm; shift_mm += finger.column_mm) {
    const double here = score(shift_mm);
    if (here <= best) continue;
    best = here;
    best_mm = shift_mm;
  }
  if (!best_mm) return std::nullopt;
  // Between the columns: the middle of the peak.
  const double before = score(*best_mm - finger.column_mm);
  const double after = score(*best_mm + finger.column_mm);
  const double bend = before - 2 * best + after;
  const double aside = bend < 0 ? (before - after) / (2 * bend) : 0;
  return *best_mm + std::clamp(aside, -0.5, 0.5) * finger.column_mm;
}

std::optional<std::array<LegReading, 2>> ReadLegs(const PageView& page, const ChannelMix& mix,
                                                  const PageMap& map, const SheetSettings& settings,
                                                  const FingerSite& site,
                                                  ReaderWorkspace& workspace) {
  const FingerStrip finger =
      LayStrip(map, site, HalfFinger_mm(settings) + kPaperTo_mm + 0.05, site.low_mm, site.high_mm);
  if (!SampleStrip(page, mix, finger.strip, workspace.samples)) return std::nullopt;
  SubtractPaper(finger, settings, site, workspace);
  // Read once at the expected and once at the found position: the windows follow the legs.
  std::array<LegReading, 2> legs;
  double middle_mm = 0;
  for (int pass = 0; pass < 2; ++pass) {
    legs = {ReadLeg(finger, settings, site, false, middle_mm, workspace),
            ReadLeg(finger, settings, site, true, middle_mm, workspace)};
    if (legs[0].rows_used == 0 || legs[1].rows_used == 0) break;
    middle_mm =
        std::clamp((legs[0].position_mm + legs[1].position_mm) / 2, -kMaxOff_mm, kMaxOff_mm);
  }
  return legs;
}

}  // namespace trammel::tool_offset
