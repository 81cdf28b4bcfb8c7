#include "pressure_advance/report/made_up_test_support.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace trammel::report::test {
namespace {

namespace pa = pressure_advance;

constexpr double kLengthMm = 30.0;
constexpr double kArea = 0.1104;
constexpr double kLayerMm = 0.25;
constexpr double kPxPerMm = 44.0;
constexpr double kExcessSigmaS = 0.0012;

double PressureAdvance(const MadeUp& made_up, std::size_t line) {
  return made_up.lines < 2 ? made_up.highest_pressure_advance_s
                           : made_up.highest_pressure_advance_s * static_cast<double>(line) /
                                 static_cast<double>(made_up.lines - 1);
}

/// Area over its mean: starved after the acceleration and overfed after the deceleration where the
/// pressure advance was too low by `lack_s`.
double RelativeArea(double position_mm, double lack_s) {
  const auto pulse = [](double x, double rise_mm, double fall_mm) {
    return x < 0 ? std::exp(-x * x / (2 * rise_mm * rise_mm)) : std::exp(-x / fall_mm);
  };
  return std::max(0.0, 1 - 28 * lack_s * pulse(position_mm - 8.4, 0.5, 2.4) +
                           34 * lack_s * pulse(position_mm - 21.9, 1.1, 0.7));
}

double BeadWidthMm(double area_mm2) {
  return area_mm2 < 0.01 ? 0.0 : area_mm2 / kLayerMm + kLayerMm * (1 - std::numbers::pi / 4);
}

Measured Around(double value, double u) {
  return Measured::Good({value, u, {value - 2.1 * u, value + 2.1 * u}});
}

pa::LineProfile MakeProfile(const MadeUp& made_up, double pressure_advance_s, Random& random) {
  pa::LineProfile profile;
  profile.pressure_advance_s = pressure_advance_s;
  if (made_up.photo) {
    profile.cross_section_unit = pa::CrossSectionUnit::kPixel;
    profile.position_unit = pa::PositionUnit::kLineLength;
  }
  for (std::size_t i = 0; i < made_up.frames; ++i) {
    const double position_mm =
        4 + 22.0 * static_cast<double>(i) / static_cast<double>(made_up.frames - 1);
    const double area = kArea * RelativeArea(position_mm, made_up.truth_s - pressure_advance_s);
    const double width = BeadWidthMm(area);
    pa::ProfileSample sample;
    sample.position = made_up.photo ? position_mm / kLengthMm : position_mm;
    sample.gap = i * 10 / made_up.frames == 4 &&
                 pressure_advance_s > 0.9 * made_up.highest_pressure_advance_s;
    if (sample.gap) {
      profile.samples.push_back(sample);
      continue;
    }
    if (made_up.photo) {
      sample.width = {width * 12 + random.Normal(0, 0.15), 0.15};
    } else {
      sample.width = {width + random.Normal(0, 0.012), 0.012};
      sample.height = {(width > 0 ? kLayerMm : 0) + random.Normal(0, 0.008), 0.008};
      sample.area = {area + random.Normal(0, 0.004), 0.004};
    }
    profile.samples.push_back(sample);
  }
  return profile;
}

pa::TransitionResult MakeTransition(const MadeUp& made_up, double zero_s, double begin_mm,
                                    double end_mm, Random& random) {
  pa::TransitionResult transition;
  transition.pressure_advance = Around(zero_s, 0.0008);
  const double scale = made_up.photo ? kLengthMm : 1.0;
  transition.window_begin = begin_mm / scale;
  transition.window_end = end_mm / scale;
  for (std::size_t i = 0; i < made_up.lines; ++i) {
    const double lack_s = zero_s - PressureAdvance(made_up, i);
    const double clipped = 0.95 * std::max(lack_s, -0.017);
    const bool used = made_up.lines <= 4 || i != 2;
    transition.fitted_s.push_back(clipped);
    transition.excess_s.push_back(clipped + random.Normal(0, kExcessSigmaS) + (used ? 0 : 0.012));
    transition.sigma_s.push_back(used ? kExcessSigmaS : 0.0);
  }
  return transition;
}

pa::LearntLaw MakeLaw(const MadeUp& made_up) {
  const auto around = [](double value, double u) -> Quantity {
    return {value, u, {value - 2 * u, value + 2 * u}};
  };
  pa::LearntLaw law;
  law.pressure_advance_s = around(made_up.truth_s - 0.0003, 0.0009);
  law.crossings_s = around(made_up.truth_s + 0.0009, 0.0012);
  law.correction_s = 0.0004;
  law.weight = 0.75;
  law.slow_lag_s = around(0.061, 0.004);
  law.fast_lag_s = around(0.0275, 0.0015);
  law.slip = around(0.012, 0.004);
  law.lag_scatter_s = 0.0014;
  law.lines = static_cast<int>(made_up.lines);
  law.learnt_from_mm = {6, 25};
  return law;
}

pa::DeviationResult MakeDeviation(const MadeUp& made_up, Random& random) {
  pa::DeviationResult deviation;
  deviation.cubic = {96.0, -3142.0, 34119.0, 119000.0};
  deviation.cubic_minimum_s = 0.038;
  deviation.r_squared = 0.9;
  double lowest = 1e9;
  for (std::size_t i = 0; i < made_up.lines; ++i) {
    const double p = PressureAdvance(made_up, i);
    const double score = 96 - 3142 * p + 34119 * p * p + 119000 * p * p * p + random.Normal(0, 4);
    deviation.score_px.push_back(score);
    if (score < lowest) {
      lowest = score;
      deviation.best_s = p;
    }
  }
  return deviation;
}

/// Shift of the laser line across the bead: a rounded profile of the bead's width and height.
double HeightPx(double from_middle_px, double area_mm2) {
  const double half_width_px = BeadWidthMm(area_mm2) * kPxPerMm / 2;
  const double t = half_width_px > 0 ? std::abs(from_middle_px) / half_width_px : 2.0;
  return t >= 1 ? 0.0 : kLayerMm * kPxPerMm * std::pow(1 - t * t * t * t, 0.5);
}

}  // namespace

pa::Analysis MakeAnalysis(const MadeUp& made_up, Random random) {
  pa::Analysis analysis;
  analysis.pressure_advance = Around(made_up.truth_s, 0.0007);
  analysis.motion.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
  if (!made_up.photo) {
    analysis.motion.length_mm = kLengthMm;
    analysis.motion.acceleration_mm_s2 = 3000;
    analysis.deviation = MakeDeviation(made_up, random);
    analysis.scale = pa::HeightScale{kPxPerMm, 1 / kPxPerMm, 0.01, 0.015};
  }
  for (std::size_t i = 0; i < made_up.lines; ++i) {
    const double p = PressureAdvance(made_up, i);
    analysis.lines.push_back({p, true, ""});
    analysis.profiles.push_back(MakeProfile(made_up, p, random));
  }
  analysis.response.pressure_advance = analysis.pressure_advance;
  analysis.response.acceleration =
      MakeTransition(made_up, made_up.truth_s + 0.0006, 6.0, 15.0, random);
  analysis.response.deceleration =
      MakeTransition(made_up, made_up.truth_s + 0.0031, 17.5, 25.5, random);
  if (!made_up.photo) analysis.response.law = MakeLaw(made_up);
  if (made_up.lines > 4) {
    analysis.lines[2].used = false;
    analysis.lines[2].reason =
        "its response lies 6.3 sigma off the fit of the other lines; look for a blob or a hair";
    analysis.notices.emplace_back(
        "the acceleration and the deceleration alone differ by 2.5 ms: filament thins at high "
        "flow");
  }
  return analysis;
}

pa::LaserScanView MakeScanView(const MadeUp& made_up, Random random) {
  pa::LaserScanView view;
  for (std::size_t line = 0; line < made_up.lines; ++line) {
    const double lack_s = made_up.truth_s - PressureAdvance(made_up, line);
    pa::HeightMap map;
    map.frames = made_up.frames;
    map.rows = made_up.rows;
    for (std::size_t frame = 0; frame < map.frames; ++frame) {
      const double position_mm =
          4 + 22.0 * static_cast<double>(frame) / static_cast<double>(made_up.frames - 1);
      map.position_mm.push_back(position_mm);
      const double area = kArea * RelativeArea(position_mm, lack_s);
      for (std::size_t row = 0; row < map.rows; ++row) {
        map.height_px.push_back(static_cast<float>(
            HeightPx(static_cast<double>(row) - static_cast<double>(map.rows) / 2, area) +
            random.Normal(0, 0.35)));
        map.sigma_px.push_back(0.35F);
      }
    }
    pa::HeightMap paper = map;
    for (float& height : paper.height_px) {
      height = 9 + 0.8F * height;
    }
    for (std::size_t i = 0; i < 40; ++i) {  // rows without a laser line
      const std::size_t at = random.Below(map.height_px.size());
      map.height_px[at] = 0;
      map.sigma_px[at] = 0;
    }
    view.heights.push_back(std::move(map));
    view.paper_heights.push_back(std::move(paper));
  }
  return view;
}

pa::PhotoView MakePhotoView(const MadeUp& made_up, Random random) {
  constexpr int kWidth = 900;
  constexpr int kPitchPx = 36;
  pa::PhotoView view;
  view.rectified = Frame(kWidth, kPitchPx * (static_cast<int>(made_up.lines) + 1));
  for (std::uint8_t& value : view.rectified.bgr) {
    value = static_cast<std::uint8_t>(random.Uniform(60, 80));
  }
  for (std::size_t line = 0; line < made_up.lines; ++line) {
    const double pressure_advance_s = PressureAdvance(made_up, line);
    const double y0 = view.rectified.height - kPitchPx * (static_cast<double>(line) + 1);
    pa::TracedLine traced{pressure_advance_s, {}, {}, {}};
    for (int x = 40; x < kWidth - 40; ++x) {
      const double position_mm = kLengthMm * (x - 40) / (kWidth - 80);
      const double area = kArea * RelativeArea(position_mm, made_up.truth_s - pressure_advance_s);
      const double half_px = BeadWidthMm(area) * 12;
      for (int y = static_cast<int>(y0 - half_px); y <= static_cast<int>(y0 + half_px); ++y) {
        std::fill_n(view.rectified.row(y) + 3 * x, 3, std::uint8_t{205});
      }
      traced.x_px.push_back(x);
      traced.centre_px.push_back(y0);
      traced.width_px.push_back(2 * half_px);
    }
    view.lines.push_back(std::move(traced));
  }
  return view;
}

}  // namespace trammel::report::test
