#include <utility>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::pressure_advance {
namespace {

/// Draws strokes and keeps the nozzle's state between them: each is reached retracted and lifted.
class Pen {
 public:
  explicit Pen(const PatternConfig& config)
      : config_(config),
        filament_per_mm_(FilamentPerMm(config)),
        print_z_mm_(PrintZ_mm(config)),
        at_{config.bed_origin_x_mm + config.bed_size_x_mm / 2,
            config.bed_origin_y_mm + config.bed_size_y_mm / 2, ApproachZ_mm(config)} {}

  /// What the following moves belong to.
  void Begin(int pattern, int line, double pressure_advance_s) {
    pattern_ = pattern;
    line_ = line;
    pressure_advance_s_ = pressure_advance_s;
  }

  /// Ends a stroke. The filament is drawn back under the pressure advance of that stroke.
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

}  // namespace trammel::pressure_advance
