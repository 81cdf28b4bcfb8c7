#pragma once

namespace trammel::tool_offset {

/// A motor and its belt repeat their error with a fixed period of travel. Each finger meets it at
/// another phase, and over all teeth it averages out, unless the pitch is nearly a whole number of
/// periods; then all fingers of a comb are off by the same, and where half the pitch is no whole
/// number the other comb by something else, which reads as an offset.
///
/// @returns What is left of the error at worst: the difference that it makes between both combs'
///          means, over the error's amplitude. The worst of periods of 2 (belt pitch), 0.8, 0.64,
///          0.4, 0.32 and 0.2 mm (cycles of 1.8° and 0.9° motors with 20 and 16 teeth, and a full
///          step), of Cartesian and CoreXY machines, each motor with its share in the direction
///          that is measured. Both structures of an axis are alike. In [0, 2].
/// REQUIRES teeth > 0.
[[nodiscard]] double MotorErrorShare(double pitch_mm, int teeth, double tilt_deg);

/// Below this a pitch is good: an error of 20 µm then makes 2 µm.
inline constexpr double kGoodMotorErrorShare = 0.1;

/// The pitch nearest to `pitch_mm`, in steps of 0.01 mm and at most 1 mm away, that is good; where
/// there is none, the one with the smallest share.
[[nodiscard]] double NearestGoodPitch_mm(double pitch_mm, int teeth, double tilt_deg);

}  // namespace trammel::tool_offset
