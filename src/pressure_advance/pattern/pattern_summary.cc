#include <algorithm>
#include <cmath>
#include <numbers>

#include "gcode/bead.h"
#include "gcode/move_time.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/material.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kSquareCornerVelocity_mm_s = 5;

double Distance_mm(const Move& move) {
  return std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm);
}

/// Speed at which one move may pass into the next; 0 where either does not move in x and y.
double JunctionSpeed_mm_s(const Move& a, const Move& b, double acceleration_mm_s2) {
  const double length_a_mm = Distance_mm(a);
  const double length_b_mm = Distance_mm(b);
  if (length_a_mm == 0 || length_b_mm == 0) return 0;
  const double cos_turn = ((a.to.x_mm - a.from.x_mm) * (b.to.x_mm - b.from.x_mm) +
                           (a.to.y_mm - a.from.y_mm) * (b.to.y_mm - b.from.y_mm)) /
                          (length_a_mm * length_b_mm);
  const double limit_mm_s = std::min(a.speed_mm_s, b.speed_mm_s);
  // theta is the angle between the two legs: straight on is pi.
  const double sin_half_theta = std::sqrt(std::clamp((1 + cos_turn) / 2, 0.0, 1.0));
  if (sin_half_theta > 1 - 1e-9) return limit_mm_s;
  const double deviation_mm = kSquareCornerVelocity_mm_s * kSquareCornerVelocity_mm_s *
                              (std::numbers::sqrt2 - 1) / acceleration_mm_s2;
  const double speed_mm_s =
      std::sqrt(deviation_mm * acceleration_mm_s2 * sin_half_theta / (1 - sin_half_theta));
  return std::min(limit_mm_s, speed_mm_s);
}

// What a move's time counts as.
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
    // Where nothing moves in x and y, z or the filament goes from rest to rest.
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
