// Claims that hold for every pattern, on configurations drawn at random.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <variant>
#include <vector>

#include "gcode/bead.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kRounding = 1e-9;  // sums of some hundred coordinates in double precision

/// Uniform in steps of a thousandth of the range, which shrinks towards lo.
double Draw(double lo, double hi) { return lo + (hi - lo) * *rc::gen::inRange(0, 1001) / 1000; }

int DrawInt(int lo, int hi) { return *rc::gen::inRange(lo, hi + 1); }

bool DrawBool() { return DrawInt(0, 1) == 1; }

/// Mostly printable: a large bed, and parts in proportion to one another.
PatternConfig DrawConfig() {
  PatternConfig config;
  config.material = "petg";
  config.dialect = gcode::Firmwares()[static_cast<std::size_t>(DrawInt(0, 4))].dialect;
  config.bed_size_x_mm = Draw(300, 600);
  config.bed_size_y_mm = Draw(300, 600);
  config.bed_origin_x_mm = DrawBool() ? -config.bed_size_x_mm / 2 : 0;
  config.bed_origin_y_mm = DrawBool() ? -config.bed_size_y_mm / 2 : 0;
  config.bed_shape = DrawBool() ? settings::BedShape::kEllipse : settings::BedShape::kRectangle;
  config.bed_margin_mm = Draw(0, 10);
  config.nozzle_diameter_mm = Draw(0.2, 1);
  config.layer_height_mm = config.nozzle_diameter_mm * Draw(0.2, 1);
  config.line_width_mm = config.nozzle_diameter_mm * Draw(1, 2);
  config.line_length_mm = Draw(20, 100);
  config.line_spacing_mm = config.line_width_mm + Draw(0.1, 5);
  config.line_count = DrawInt(2, 20);
  config.pressure_advance_start_s = Draw(0, 1);
  config.pressure_advance_end_s = config.pressure_advance_start_s + Draw(0.01, 1);
  const double slow = Draw(0.1, 0.4);
  config.segments = {{slow, Draw(3, 20)}, {1 - 2 * slow, Draw(30, 100)}, {slow, Draw(3, 20)}};
  config.acceleration_mm_s2 = Draw(3000, 20000);
  config.alternate_directions = DrawBool();
  config.frame_loops = DrawInt(0, 4);
  config.frame_overlap_mm = Draw(-1, 0.2);
  config.retract_length_mm = DrawBool() ? Draw(0.1, 6) : 0;
  config.z_hop_mm = DrawBool() ? Draw(0.1, 2) : 0;
  config.z_offset_mm = config.layer_height_mm * Draw(-0.4, 0.4);
  config.prime_length_mm = Draw(0, 5);
  config.columns = DrawInt(1, 3);
  config.rows = DrawInt(1, 3);
  if (DrawBool()) config.position_x_mm = config.bed_origin_x_mm + Draw(0, 200);
  if (DrawBool()) config.position_y_mm = config.bed_origin_y_mm + Draw(0, 200);
  return config;
}

PatternConfig DrawValidConfig() {
  const PatternConfig config = DrawConfig();
  RC_PRE(Validate(config).has_value());
  return config;
}

bool OnBed(const PatternConfig& config, double x_mm, double y_mm, double margin_mm) {
  const double x = (x_mm - config.bed_origin_x_mm) - config.bed_size_x_mm / 2;
  const double y = (y_mm - config.bed_origin_y_mm) - config.bed_size_y_mm / 2;
  const double half_x = config.bed_size_x_mm / 2 - margin_mm + kRounding;
  const double half_y = config.bed_size_y_mm / 2 - margin_mm + kRounding;
  if (config.bed_shape == settings::BedShape::kEllipse)
    return std::hypot(x / half_x, y / half_y) <= 1;
  return std::abs(x) <= half_x && std::abs(y) <= half_y;
}

bool Prints(const Move& move) {
  return move.kind == MoveKind::kFrame || move.kind == MoveKind::kLine;
}

double Length(const Move& move) {
  return std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm);
}

RC_GTEST_PROP(PatternProperty, MovesStayOnTheBedAndFollowOneAnother, ()) {
  const PatternConfig config = DrawValidConfig();
  const PatternLayout layout = LayOut(config);
  const PointMm* at = nullptr;
  for (const Move& move : layout.moves) {
    if (at != nullptr) {
      RC_ASSERT(at->x_mm == move.from.x_mm && at->y_mm == move.from.y_mm &&
                at->z_mm == move.from.z_mm);
    }
    at = &move.to;
    RC_ASSERT(move.to.z_mm > 0);
    RC_ASSERT(move.speed_mm_s > 0);
    RC_ASSERT(OnBed(config, move.to.x_mm, move.to.y_mm, 0));
    if (Prints(move)) RC_ASSERT(OnBed(config, move.to.x_mm, move.to.y_mm, config.bed_margin_mm));
  }
}

RC_GTEST_PROP(PatternProperty, FilamentEqualsTheVolumeOfTheBeads, ()) {
  const PatternConfig config = DrawValidConfig();
  const double filament_area_mm2 =
      std::numbers::pi / 4 * config.filament_diameter_mm * config.filament_diameter_mm;
  const double bead_area_mm2 = gcode::BeadArea_mm2(config.line_width_mm, config.layer_height_mm);
  const PatternLayout layout = LayOut(config);
  double printed_mm = 0;
  for (const Move& move : layout.moves) {
    if (!Prints(move)) continue;
    RC_ASSERT(move.filament_mm > 0);
    RC_ASSERT(std::abs(move.filament_mm * filament_area_mm2 - Length(move) * bead_area_mm2) <
              kRounding);
    printed_mm += Length(move);
  }
  const double frames = config.frame_loops > 0 ? config.columns * config.rows : 0;
  const double expected_mm = printed_mm * bead_area_mm2 / filament_area_mm2 +
                             frames * config.prime_length_mm - config.retract_length_mm;
  RC_ASSERT(std::abs(Summarise(layout, config).filament_mm - expected_mm) < 1e-6);
}

RC_GTEST_PROP(PatternProperty, EveryLineIsPrintedWholeUnderItsPressureAdvance, ()) {
  const PatternConfig config = DrawValidConfig();
  const PatternLayout layout = LayOut(config);
  RC_ASSERT(layout.lines.size() ==
            static_cast<std::size_t>(config.line_count * config.columns * config.rows));
  std::vector<double> printed_mm(layout.lines.size(), 0);
  for (const Move& move : layout.moves) {
    if (move.kind != MoveKind::kLine) continue;
    const PatternLine& line = layout.lines.at(static_cast<std::size_t>(move.line));
    RC_ASSERT(move.pressure_advance_s == line.pressure_advance_s);
    RC_ASSERT(move.pattern == line.pattern);
    const bool first = move.segment == 0;
    const bool last = move.segment + 1 == static_cast<int>(config.segments.size());
    if (first) RC_ASSERT(move.from.x_mm == line.start.x_mm && move.from.y_mm == line.start.y_mm);
    if (last) RC_ASSERT(move.to.x_mm == line.end.x_mm && move.to.y_mm == line.end.y_mm);
    printed_mm[static_cast<std::size_t>(move.line)] += Length(move);
  }
  for (double length_mm : printed_mm) {
    RC_ASSERT(std::abs(length_mm - config.line_length_mm) < kRounding);
  }
}

RC_GTEST_PROP(PatternProperty, TravelsAreRetractedAndLiftedAndPrintsAreNot, ()) {
  const PatternConfig config = DrawValidConfig();
  const double print_z_mm = config.layer_height_mm + config.z_offset_mm;
  double drawn_back_mm = 0;
  for (const Move& move : LayOut(config).moves) {
    if (move.kind == MoveKind::kRetract || move.kind == MoveKind::kUnretract) {
      drawn_back_mm -= move.filament_mm;
    }
    if (move.kind == MoveKind::kTravel) {
      RC_ASSERT(drawn_back_mm == config.retract_length_mm);
      RC_ASSERT(move.from.z_mm >= print_z_mm + config.z_hop_mm - kRounding);
    }
    if (Prints(move)) {
      RC_ASSERT(drawn_back_mm == 0);
      RC_ASSERT(move.from.z_mm == print_z_mm && move.to.z_mm == print_z_mm);
    }
  }
}

RC_GTEST_PROP(PatternProperty, TimeIsAtLeastThatOfTheCommandedSpeeds, ()) {
  const PatternConfig config = DrawValidConfig();
  const PatternLayout layout = LayOut(config);
  double min_s = 0;
  double ramps_s = 0;
  for (const Move& move : layout.moves) {
    const double path = Length(move) + std::abs(move.to.z_mm - move.from.z_mm);
    min_s += (path > 0 ? path : std::abs(move.filament_mm)) / move.speed_mm_s;
    ramps_s += 2 * move.speed_mm_s / config.acceleration_mm_s2;
  }
  const double time_s = Summarise(layout, config).time_s;
  RC_ASSERT(time_s >= min_s - 1e-6);
  RC_ASSERT(time_s <= min_s + ramps_s);
}

/// Writes a value that nobody means into one number of the configuration.
struct Spoiler {
  PatternConfig& config;
  double value;

  void operator()(double PatternConfig::*member) const { config.*member = value; }
  void operator()(std::optional<double> PatternConfig::*member) const { config.*member = value; }
  void operator()(std::vector<double> PatternConfig::*member) const {
    config.*member = {0, value, 0.5};
  }
  void operator()(std::vector<Segment> PatternConfig::*member) const {
    (config.*member)[0] = {value, value};
  }
  void operator()(int PatternConfig::*member) const {
    config.*member = std::abs(value) < 1e9 ? static_cast<int>(value) : -1;
  }
  template <class Other>
  void operator()(Other) const {}
};

RC_GTEST_PROP(PatternProperty, AbsurdNumbersAreRefusedOrPrintable, ()) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PatternConfig config = DrawConfig();
  const auto fields = PatternFields();
  for (int i = DrawInt(1, 3); i > 0; --i) {
    const auto& field = fields[static_cast<std::size_t>(DrawInt(0, int(fields.size()) - 1))];
    const double value =
        *rc::gen::element(std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity, 0.0,
                          -1.0, 1e-300, 1e300, -1e9, 1e9, 100.0, field.lo, field.hi);
    std::visit(Spoiler{config, value}, field.member);
  }
  if (!Validate(config)) return;
  const PatternLayout layout = LayOut(config);
  const PatternSummary summary = Summarise(layout, config);
  RC_ASSERT(std::isfinite(summary.time_s) && summary.time_s > 0);
  for (const Move& move : layout.moves) {
    RC_ASSERT(OnBed(config, move.to.x_mm, move.to.y_mm, 0));
    RC_ASSERT(move.to.z_mm > 0);
  }
  RC_ASSERT(WriteGcode(layout, config).find("nan") == std::string::npos);
}

}  // namespace
}  // namespace trammel::pressure_advance
