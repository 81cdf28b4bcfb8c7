#pragma once

namespace trammel::tool_offset {

/// Computes the share of a motor's periodic error that remains in an offset. A motor and its belt
/// repeat their error with a fixed period of travel. Each finger has another phase of it, so it
/// averages out over all teeth, unless the pitch is nearly a whole number of periods. Then all
/// fingers of a comb are off by the same amount; if half the pitch is no whole number, the other
/// comb is off by another, which reads as an offset.
///
/// @returns The worst remaining error: its difference between both combs' means, over the error's
/// amplitude. The worst of periods of 2 (belt pitch), 0.8, 0.64, 0.4, 0.32 and 0.2 mm (cycles of
/// 1.8° and 0.9° motors with 20 and 16 teeth, and a full step), of Cartesian and CoreXY machines,
/// each motor with its share in the measured direction. Both structures of an axis are alike. In
/// [0, 2].
/// REQUIRES teeth > 0.
[[nodiscard]] double MotorErrorShare(double pitch_mm, int teeth, double tilt_deg);

/// Maximum share of a good pitch: an error of 20 µm then causes 2 µm.
inline constexpr double kGoodMotorErrorShare = 0.1;

/// Returns the good pitch nearest to `pitch_mm`, in steps of 0.01 mm and at most 1 mm away; if
/// there is none, the one with the smallest share.
[[nodiscard]] double NearestGoodPitch_mm(double pitch_mm, int teeth, double tilt_deg);

}  // namespace trammel::tool_offset
