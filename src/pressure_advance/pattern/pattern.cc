#include "pressure_advance/pattern/pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "gcode/bead.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/material.h"

namespace trammel::pressure_advance {
namespace {

/// Draws strokes and tracks the nozzle's state between them: each is reached retracted and lifted.
class Pen {
 public:
  explicit Pen(const PatternConfig& config)
      : config_(config),
        filament_per_mm_(FilamentPerMm(config)),
        print_z_mm_(PrintZ_mm(config)),
        at_{config.bed_origin_x_mm + config.bed_size_x_mm / 2,
            config.bed_origin_y_mm + config.bed_size_y_mm / 2, ApproachZ_mm(config)} {}

  /// Sets the labels of the next moves.
  void Begin(int pattern, int line, double pressure_advance_s) {
    pattern_ = pattern;
    line_ = line;
    pressure_advance_s_ = pressure_advance_s;
  }

  /// Ends a stroke. The filament is retracted under the pressure advance of that stroke.
  void Leave() {
    if (retracted_) return;
    Filament(MoveKind::kRetract, -config_.retract_length_mm, config_.retract_speed_mm_s);
    retracted_ = true;
  }

  void GoTo(const PointMm& target, bool lifted = true) {
    if (lifted) Height(at_.z_mm > print_z_mm_ ? at_.z_mm : print_z_mm_ + config_.z_hop_mm);
    Travel(target);
    Height(print_z_mm_);
    Filament(MoveKind::kUnretract, config_.retract_length_mm, config_.retract_speed_mm_s);
    retracted_ = false;
  }

  void Prime() { Filament(MoveKind::kPrime, config_.prime_length_mm, config_.retract_speed_mm_s); }

  void Extrude(MoveKind kind, const PointMm& target, double length_mm, double speed_mm_s,
               int segment) {
    Move move = NewMove(kind, target, speed_mm_s);
    move.filament_mm = length_mm * filament_per_mm_;
    move.width_mm = config_.line_width_mm;
    move.segment = segment;
    Add(move);
  }

  void Park(const PointMm& target) {
    Height(target.z_mm);
    Travel(target);
  }

  [[nodiscard]] std::vector<Move> TakeMoves() { return std::move(moves_); }

 private:
  [[nodiscard]] Move NewMove(MoveKind kind, const PointMm& to, double speed_mm_s) const {
    Move move;
    move.kind = kind;
    move.from = at_;
    move.to = to;
    move.speed_mm_s = speed_mm_s;
    move.pressure_advance_s = pressure_advance_s_;
    move.pattern = pattern_;
    move.line = line_;
    return move;
  }

  void Add(const Move& move) {
    moves_.push_back(move);
    at_ = move.to;
  }

  void Height(double z_mm) {
    if (z_mm == at_.z_mm) return;
    Add(NewMove(z_mm > at_.z_mm ? MoveKind::kLift : MoveKind::kLower, {at_.x_mm, at_.y_mm, z_mm},
                config_.z_speed_mm_s));
  }

  void Travel(const PointMm& target) {
    if (target.x_mm == at_.x_mm && target.y_mm == at_.y_mm) return;
    Add(NewMove(MoveKind::kTravel, {target.x_mm, target.y_mm, at_.z_mm},
                config_.travel_speed_mm_s));
  }

  void Filament(MoveKind kind, double filament_mm, double speed_mm_s) {
    if (filament_mm == 0) return;
    Move move = NewMove(kind, at_, speed_mm_s);
    move.filament_mm = filament_mm;
    Add(move);
  }

  const PatternConfig& config_;
  double filament_per_mm_;
  double print_z_mm_;
  PointMm at_;
  bool retracted_ = false;
  int pattern_ = -1;
  int line_ = -1;
  double pressure_advance_s_ = 0;
  std::vector<Move> moves_;
};

void DrawFrame(const PatternConfig& config, const BoundsMm& outer, Pen& pen) {
  const PatternGeometry geometry = Geometry(config);
  const double z_mm = PrintZ_mm(config);
  for (int loop = 0; loop < config.frame_loops; ++loop) {
    const double inset_mm = config.line_width_mm / 2 + loop * geometry.loop_pitch_mm;
    const PointMm front_left{outer.min_x_mm + inset_mm, outer.min_y_mm + inset_mm, z_mm};
    const PointMm back_right{outer.max_x_mm - inset_mm, outer.max_y_mm - inset_mm, z_mm};
    const double width_mm = back_right.x_mm - front_left.x_mm;
    const double depth_mm = back_right.y_mm - front_left.y_mm;
    pen.Leave();
    pen.GoTo(front_left);
    if (loop == 0) pen.Prime();
    const double speed_mm_s = config.frame_speed_mm_s;
    pen.Extrude(MoveKind::kFrame, {back_right.x_mm, front_left.y_mm, z_mm}, width_mm, speed_mm_s,
                -1);
    pen.Extrude(MoveKind::kFrame, back_right, depth_mm, speed_mm_s, -1);
    pen.Extrude(MoveKind::kFrame, {front_left.x_mm, back_right.y_mm, z_mm}, width_mm, speed_mm_s,
                -1);
    pen.Extrude(MoveKind::kFrame, front_left, depth_mm, speed_mm_s, -1);
  }
}

// Fills the front left corner inside the frame, where the first line starts.
void DrawMark(const PatternConfig& config, const BoundsMm& outer, Pen& pen) {
  const PatternGeometry geometry = Geometry(config);
  const double loops_mm =
      config.line_width_mm / 2 + (config.frame_loops - 1) * geometry.loop_pitch_mm;
  for (int bead = 1; bead <= geometry.mark_beads; ++bead) {
    const PointMm left{outer.min_x_mm + loops_mm + geometry.loop_pitch_mm,
                       outer.min_y_mm + loops_mm + bead * geometry.loop_pitch_mm,
                       PrintZ_mm(config)};
    const double length_mm = geometry.mark_length_mm - geometry.loop_pitch_mm;
    pen.Leave();
    pen.GoTo(left);
    pen.Extrude(MoveKind::kFrame, {left.x_mm + length_mm, left.y_mm, left.z_mm}, length_mm,
                config.frame_speed_mm_s, -1);
  }
}

PatternLine LineOf(const PatternConfig& config, const BoundsMm& outer, int pattern, int index,
                   double pressure_advance_s) {
  const PatternGeometry geometry = Geometry(config);
  const double y_mm = outer.min_y_mm + geometry.inset_y_mm + index * config.line_spacing_mm;
  const PointMm left{outer.min_x_mm + geometry.inset_x_mm, y_mm, PrintZ_mm(config)};
  const PointMm right{left.x_mm + config.line_length_mm, y_mm, left.z_mm};
  const bool backwards = config.alternate_directions && index % 2 == 1;
  return {pattern, pressure_advance_s, backwards ? right : left, backwards ? left : right};
}

void DrawLine(const PatternConfig& config, const PatternLine& line, Pen& pen) {
  double fraction_done = 0;
  for (std::size_t i = 0; i < config.segments.size(); ++i) {
    const Segment& segment = config.segments[i];
    fraction_done += segment.fraction;
    PointMm target = line.end;
    if (i + 1 < config.segments.size()) {
      target.x_mm = line.start.x_mm + fraction_done * (line.end.x_mm - line.start.x_mm);
    }
    pen.Extrude(MoveKind::kLine, target, segment.fraction * config.line_length_mm,
                segment.speed_mm_s, static_cast<int>(i));
  }
}

}  // namespace

PatternLayout LayOut(const PatternConfig& config) {
  PatternLayout layout;
  layout.printed = OuterBounds(config);
  Pen pen(config);
  for (int pattern = 0; pattern < PatternCount(config); ++pattern) {
    const BoundsMm outer = PatternBounds(config, pattern);
    layout.patterns.push_back(outer);
    if (pattern > 0) pen.Leave();  // under the last line's own pressure advance
    pen.Begin(pattern, -1, config.frame_pressure_advance_s);
    DrawFrame(config, outer, pen);
    DrawMark(config, outer, pen);
    const std::vector<double> pressure_advances_s = PressureAdvances(config);
    const PatternConfig one = SettingsOf(config, pattern);
    for (std::size_t i = 0; i < pressure_advances_s.size(); ++i) {
      layout.lines.push_back(
          LineOf(config, outer, pattern, static_cast<int>(i), pressure_advances_s[i]));
      pen.Leave();
      pen.Begin(pattern, static_cast<int>(layout.lines.size()) - 1, pressure_advances_s[i]);
      pen.GoTo(layout.lines.back().start, i == 0 || config.lift_between_lines);
      DrawLine(one, layout.lines.back(), pen);
    }
  }
  pen.Leave();
  pen.Begin(-1, -1, config.frame_pressure_advance_s);
  pen.Park(ParkPoint(config));
  layout.moves = pen.TakeMoves();
  return layout;
}

namespace {

constexpr double kSquareCornerVelocity_mm_s = 5;

double Distance_mm(const Move& move) {
  return std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm);
}

/// Returns the speed at which one move may pass into the next; 0 if either does not move in x and
/// y.
double JunctionSpeed_mm_s(const Move& a, const Move& b, double acceleration_mm_s2) {
  const double length_a_mm = Distance_mm(a);
  const double length_b_mm = Distance_mm(b);
  if (length_a_mm == 0 || length_b_mm == 0) return 0;
  const double cos_turn = ((a.to.x_mm - a.from.x_mm) * (b.to.x_mm - b.from.x_mm) +
                           (a.to.y_mm - a.from.y_mm) * (b.to.y_mm - b.from.y_mm)) /
                          (length_a_mm * length_b_mm);
  const double limit_mm_s = std::min(a.speed_mm_s, b.speed_mm_s);
  // theta is the angle between the two legs: pi for straight on.
  const double sin_half_theta = std::sqrt(std::clamp((1 + cos_turn) / 2, 0.0, 1.0));
  if (sin_half_theta > 1 - 1e-9) return limit_mm_s;
  const double deviation_mm = kSquareCornerVelocity_mm_s * kSquareCornerVelocity_mm_s *
                              (std::numbers::sqrt2 - 1) / acceleration_mm_s2;
  const double speed_mm_s =
      std::sqrt(deviation_mm * acceleration_mm_s2 * sin_half_theta / (1 - sin_half_theta));
  return std::min(limit_mm_s, speed_mm_s);
}

// Returns the counter of a move's time.
double& PartOf(PatternTime& time, const Move& move, bool begun) {
  switch (move.kind) {
    case MoveKind::kLine:
      return time.lines_s;
    case MoveKind::kFrame:
    case MoveKind::kPrime:
      return time.frame_s;
    default:
      return move.pattern < 0 || !begun ? time.to_and_fro_s : time.between_s;
  }
}

PatternTime TimeOf(const std::vector<Move>& moves, const PatternConfig& config) {
  std::vector<double> of_pattern_mm_s2;
  for (int pattern = 0; pattern < PatternCount(config); ++pattern) {
    of_pattern_mm_s2.push_back(SettingsOf(config, pattern).acceleration_mm_s2);
  }
  const auto acceleration_mm_s2 = [&](const Move& move) {
    return move.pattern < 0 ? config.acceleration_mm_s2
                            : of_pattern_mm_s2[static_cast<std::size_t>(move.pattern)];
  };
  // junction[i] is the speed at the start of move i; the last entry is the stop at the end.
  std::vector<double> junction_mm_s(moves.size() + 1, 0.0);
  for (std::size_t i = 1; i < moves.size(); ++i) {
    junction_mm_s[i] = JunctionSpeed_mm_s(moves[i - 1], moves[i], acceleration_mm_s2(moves[i]));
  }
  const auto reachable = [&](double from_mm_s, const Move& move) {
    return std::sqrt(from_mm_s * from_mm_s + 2 * acceleration_mm_s2(move) * Distance_mm(move));
  };
  for (std::size_t i = moves.size(); i-- > 0;) {
    junction_mm_s[i] = std::min(junction_mm_s[i], reachable(junction_mm_s[i + 1], moves[i]));
  }
  PatternTime time;
  bool begun = false;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const Move& move = moves[i];
    junction_mm_s[i + 1] = std::min(junction_mm_s[i + 1], reachable(junction_mm_s[i], move));
    // Without motion in x and y, z or the filament moves from rest to rest.
    double length_mm = Distance_mm(move);
    if (length_mm == 0) {
      length_mm = std::abs(move.to.z_mm - move.from.z_mm) + std::abs(move.filament_mm);
    }
    begun = begun || move.width_mm > 0;
    PartOf(time, move, begun) += gcode::MoveTime_s(length_mm, junction_mm_s[i], move.speed_mm_s,
                                                   junction_mm_s[i + 1], acceleration_mm_s2(move));
  }
  return time;
}

}  // namespace

PatternSummary Summarise(const PatternLayout& layout, const PatternConfig& config) {
  PatternSummary summary;
  summary.printed = layout.printed;
  summary.time = TimeOf(layout.moves, config);
  summary.time_s = summary.time.total_s();
  const double bead_area_mm2 = gcode::BeadArea_mm2(config.line_width_mm, config.layer_height_mm);
  for (const Move& move : layout.moves) {
    summary.filament_mm += move.filament_mm;
    summary.max_z_mm = std::max({summary.max_z_mm, move.from.z_mm, move.to.z_mm});
    if (move.width_mm > 0) {
      summary.peak_flow_mm3_s = std::max(summary.peak_flow_mm3_s, bead_area_mm2 * move.speed_mm_s);
    }
  }
  const double filament_area_mm2 =
      std::numbers::pi / 4 * config.filament_diameter_mm * config.filament_diameter_mm;
  constexpr double kCm3PerMm3 = 1e-3;
  if (const auto density_g_cm3 = settings::Density_g_cm3(config)) {
    summary.filament_g = summary.filament_mm * filament_area_mm2 * kCm3PerMm3 * *density_g_cm3;
  }
  return summary;
}

}  // namespace trammel::pressure_advance
