// Simulates a hot end that stores filament, and the line that it lays.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// Head position over time along a line: slow, fast, slow, with ramps of constant acceleration.
class HeadMotion {
 public:
  /// REQUIRES a slow, a fast and a slow segment, a length and an acceleration.
  explicit HeadMotion(const LineMotion& motion);

  [[nodiscard]] double slow_mm_s() const { return slow_mm_s_; }
  [[nodiscard]] double fast_mm_s() const { return fast_mm_s_; }
  /// Returns the ends of a model's time steps, s: short about changes of speed, from before the
  /// first to after the line's end.
  [[nodiscard]] const std::vector<double>& times_s() const { return times_s_; }
  /// Positions at these times, from the line's start.
  [[nodiscard]] const std::vector<double>& positions_mm() const { return positions_mm_; }

  /// Motion that a drive follows at these times.
  struct Drive {
    std::vector<double> position_mm;
    std::vector<double> speed_mm_s;
  };
  /// Smooths the position by a triangle, as Klipper does with pressure advance.
  /// @param width_s  of the triangle's base; >= 0
  [[nodiscard]] Drive Averaged(double width_s) const;

 private:
  // Phase of constant acceleration: the second integral of the position as a polynomial of the time
  // since its beginning, lowest power first.
  struct Phase {
    double begin_s = 0;
    std::array<double, 5> twice_integrated{};
  };
  struct Way {
    double twice_integrated = 0, integrated = 0, mm = 0, mm_s = 0;
  };
  [[nodiscard]] Way At(double time_s) const;
  void Continue(double from_s, double speed_mm_s, double acceleration_mm_s2);
  void DivideTime(double end_s);

  double slow_mm_s_ = 0, fast_mm_s_ = 0;
  std::vector<Phase> phases_;
  std::vector<double> times_s_, positions_mm_;
};

/// Flows at which a law's exponent may change, relative to the fast one.
inline constexpr std::array<double, 3> kStorageBreaks{0.13, 0.3, 0.65};

/// Unknowns of an extruder and of the line that it lays.
struct Lag {
  double lag_s = 0.03;  ///< secant of the filament stored, between the slow and the fast speed; > 0
  /// Exponents of flow in the storage, from stretch to stretch of flows (kStorageBreaks); > 0.
  std::array<double, 4> exponent{1, 1, 1, 1};
  double second = 0;       ///< share of the storage that lies in a second, linear stage; 0 … 1
  double slip = 0;         ///< share of the drive lost at the fast flow; grows as its square
  double loss = 0;         ///< share of the filament that a gap does not claim back; 0 … 1
  double smooth_s = 0.04;  ///< width of the triangle that the drive is averaged with; >= 0
  double smear_mm = 0.4;   ///< length over which filament spreads; > 0
};

/// Stored filament over flow, dS/dq ~ (q / q0)^(n - 1), continuous between stretches; its secant
/// between the slow and the fast speed is one second.
class StoredModel {
 public:
  StoredModel(const HeadMotion& motion, const std::array<double, 4>& exponent);

  /// @param flow_mm_s  of filament along the line, >= 0
  /// @returns mm
  [[nodiscard]] double Stored(double flow_mm_s) const;
  /// Computes the storage's derivative over flow, s. @param flow_mm_s  > 0
  [[nodiscard]] double LagAt(double flow_mm_s) const;
  struct Flow {
    double mm_s = 0;
    double per_s = 0;  ///< derivative by the stored volume
  };
  /// Looks the flow up in a table.
  /// @param stored_mm  > 0
  [[nodiscard]] Flow At(double stored_mm) const;

 private:
  struct Piece {
    double begin = 0, stored = 0;  // at the start
    double anchor = 1, n = 1, lag_s = 1;
    double at_anchor = 0;  // 1 where the stretch begins at its anchor, 0 where it begins at rest

    [[nodiscard]] double Stored(double flow) const;
    [[nodiscard]] double LagAt(double flow) const;
    [[nodiscard]] Flow At(double level) const;
  };
  [[nodiscard]] Flow Exact(double stored_mm) const;
  [[nodiscard]] const Piece& PieceOf(double flow_mm_s) const;

  std::array<Piece, 4> pieces_;
  double cells_per_mm_ = 0;
  std::vector<double> flow_mm_s_;
};

/// Lays lines of one pattern with one lag; common parts are computed once.
class LagModel {
 public:
  /// @param motion  outlives the model
  LagModel(const HeadMotion& motion, const Lag& lag);
  /// Returns the model of another lag; shares the common parts with this one.
  [[nodiscard]] LagModel With(const Lag& lag) const;

  [[nodiscard]] const Lag& lag() const { return lag_; }
  struct Line {
    double lag_s = 0;  ///< replaces the model's own, > 0
    double pressure_advance_s = 0;
    /// Rising, from the line's start; steady flow before the motion begins.
    std::span<const double> positions_mm;
  };
  /// Lays lines side by side, since one line alone would stall a processor.
  /// @returns areas at each line's positions, relative to the nominal one
  [[nodiscard]] std::vector<std::vector<double>> Lay(std::span<const Line> lines) const;
  /// Returns the pressure advance that supplies the filament stored by the change of speed, slip
  /// included.
  [[nodiscard]] double RightPressureAdvance() const;
  /// Computes the derivative of the stored filament over flow at an even flow, s: the lag of a
  /// small change of speed there.
  /// @param flow_mm_s  > 0
  [[nodiscard]] double LagAt(double flow_mm_s) const;

 private:
  LagModel() = default;
  [[nodiscard]] double Kept(double flow_mm_s) const;
  [[nodiscard]] std::vector<double> Extrude(std::span<const Line> lines) const;

  const HeadMotion* motion_ = nullptr;
  Lag lag_;
  std::shared_ptr<const StoredModel> law_;
  std::shared_ptr<const HeadMotion::Drive> even_, averaged_;
};

}  // namespace trammel::pressure_advance
