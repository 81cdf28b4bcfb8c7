#include "pressure_advance/report/made_up_test_support.h"

#include <algorithm>
#include <cmath>

namespace trammel::report::test {
namespace {

namespace pa = pressure_advance;

constexpr double kTruth_s = 0.0362;
constexpr double kHighest_s = 0.06;
constexpr double kLengthMm = 30.0;

double PressureAdvanceOf(const MadeUp& made_up, std::size_t line) {
  return kHighest_s * static_cast<double>(line) /
         static_cast<double>(std::max<std::size_t>(made_up.lines, 2) - 1);
}

double PositionMm(const MadeUp& made_up, std::size_t frame) {
  return 4 + 22.0 * static_cast<double>(frame) / static_cast<double>(made_up.frames - 1);
}

Measured Around(double value, double u) {
  return Measured::Good({value, u, {value - 2.1 * u, value + 2.1 * u}});
}

pa::LineProfile MakeProfile(const MadeUp& made_up, double pressure_advance_s) {
  pa::LineProfile profile;
  profile.pressure_advance_s = pressure_advance_s;
  if (made_up.photo) {
    profile.cross_section_unit = pa::CrossSectionUnit::kPixel;
    profile.position_unit = pa::PositionUnit::kLineLength;
  }
  for (std::size_t i = 0; i < made_up.frames; ++i) {
    const double position_mm = PositionMm(made_up, i);
    const bool starved = position_mm > 8 && position_mm < 13;
    const double relative = starved ? 1 - 10 * (kTruth_s - pressure_advance_s) : 1;
    pa::ProfileSample sample;
    if (made_up.photo) {
      sample.position = position_mm / kLengthMm;
      sample.width = {5 * relative, 0.15};
    } else {
      sample.position = position_mm;
      sample.width = {0.44 * relative, 0.012};
      sample.height = {0.25, 0.008};
      sample.area = {0.11 * relative, 0.004};
    }
    profile.samples.push_back(sample);
  }
  return profile;
}

pa::TransitionResult MakeTransition(const MadeUp& made_up, double zero_s, const Range& window_mm) {
  pa::TransitionResult transition;
  transition.pressure_advance = Around(zero_s, 0.0008);
  const double scale = made_up.photo ? kLengthMm : 1.0;
  transition.window_begin = window_mm.lo / scale;
  transition.window_end = window_mm.hi / scale;
  for (std::size_t i = 0; i < made_up.lines; ++i) {
    const bool used = made_up.lines <= 4 || i != 2;
    transition.fitted_s.push_back(zero_s - PressureAdvanceOf(made_up, i));
    transition.surplus_s.push_back(transition.fitted_s.back() + (used ? 0.001 : 0.012));
    transition.sigma_s.push_back(used ? 0.0012 : 0.0);
  }
  return transition;
}

pa::WeighedStorage MakeLaw(const MadeUp& made_up) {
  const auto around = [](double value, double u) -> Quantity {
    return {value, u, {value - 2 * u, value + 2 * u}};
  };
  pa::WeighedStorage law;
  law.pressure_advance_s = around(kTruth_s - 0.0003, 0.0009);
  law.crossings_s = around(kTruth_s + 0.0009, 0.0012);
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

}  // namespace

pa::FlowRatio MakeFlow() {
  pa::FlowRatio flow;
  flow.ratio = Measured::Good({1.031, 0.009, {1.013, 1.049}});
  flow.areas.emplace();
  flow.areas->slow = pa::AreaShare{0.945, 0.004, 8, 10};
  flow.areas->fast = pa::AreaShare{0.927, 0.005, 8, 10};
  flow.budget = {0.004, 0.004, 0.005, 0.004};
  return flow;
}

pa::Analysis MakeAnalysis(const MadeUp& made_up) {
  pa::Analysis analysis;
  analysis.pressure_advance = Around(kTruth_s, 0.0007);
  analysis.response.pressure_advance = analysis.pressure_advance;
  analysis.response.acceleration = MakeTransition(made_up, kTruth_s + 0.0006, {6.0, 15.0});
  analysis.response.deceleration = MakeTransition(made_up, kTruth_s + 0.0031, {17.5, 25.5});
  analysis.motion.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
  for (std::size_t i = 0; i < made_up.lines; ++i) {
    const double pressure_advance_s = PressureAdvanceOf(made_up, i);
    analysis.lines.push_back({pressure_advance_s, true, ""});
    analysis.profiles.push_back(MakeProfile(made_up, pressure_advance_s));
    analysis.deviation.score_px.push_back(60 - 500 * pressure_advance_s);
  }
  if (made_up.photo) {
    analysis.deviation = {};
  } else {
    analysis.motion.length_mm = kLengthMm;
    analysis.motion.acceleration_mm_s2 = 3000;
    analysis.deviation.best_s = kHighest_s;
    analysis.deviation.cubic = {96.0, -3142.0, 34119.0, 119000.0};
    analysis.deviation.cubic_minimum_s = 0.038;
    analysis.deviation.r_squared = 0.9;
    analysis.scale = pa::HeightScale{44, 1 / 44.0, 0.01, 0.015};
    analysis.response.law = MakeLaw(made_up);
    analysis.flow = MakeFlow();
  }
  if (made_up.lines > 4) {
    analysis.lines[2].used = false;
    analysis.lines[2].reason = "its response lies off the fit of the other lines";
    analysis.notices.emplace_back("the acceleration and the deceleration alone differ by 2.5 ms");
  }
  return analysis;
}

pa::LaserScanView MakeScanView(const MadeUp& made_up) {
  constexpr std::size_t kRows = 24;
  pa::HeightMap map;
  map.frames = made_up.frames;
  map.rows = kRows;
  for (std::size_t frame = 0; frame < map.frames; ++frame) {
    map.position_mm.push_back(PositionMm(made_up, frame));
    for (std::size_t row = 0; row < kRows; ++row) {
      map.height_px.push_back(row > 7 && row < 17 ? 11.0F : 0.0F);
      map.sigma_px.push_back((frame + row) % 20 == 0 ? 0.0F : 0.35F);  // 0: no laser line
    }
  }
  pa::LaserScanView view;
  view.heights.assign(made_up.lines, map);
  return view;
}

pa::PhotoView MakePhotoView(const MadeUp& made_up) {
  constexpr int kWidth = 900;
  constexpr int kPitchPx = 36;
  pa::PhotoView view;
  view.rectified = Frame(kWidth, kPitchPx * (static_cast<int>(made_up.lines) + 1));
  std::fill(view.rectified.bgr.begin(), view.rectified.bgr.end(), std::uint8_t{70});
  for (std::size_t line = 0; line < made_up.lines; ++line) {
    pa::TracedLine traced{PressureAdvanceOf(made_up, line), {}, {}, {}};
    for (int x = 40; x < kWidth - 40; ++x) {
      traced.x_px.push_back(x);
      traced.centre_px.push_back(kPitchPx * (static_cast<double>(line) + 0.5));
      traced.width_px.push_back(10);
    }
    view.lines.push_back(std::move(traced));
  }
  return view;
}

}  // namespace trammel::report::test
