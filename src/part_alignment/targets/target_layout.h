// What a ring-coded target looks like, in units of its disc's radius.
#pragma once

namespace trammel::part_alignment {

/// Schneider's layout: a disc, a ring of as many equal segments as the code has bits, and nothing
/// else. Segment k spans the angles 2 pi k / bits … 2 pi (k + 1) / bits, clockwise from the right
/// as one looks at the target, and is inked where bit k of the word is 1.
inline constexpr double kRingInner = 2.0;  ///< radius of the ring's inner edge
inline constexpr double kRingOuter = 3.0;  ///< radius of its outer edge
/// Within this radius nothing but disc and ring may be seen.
inline constexpr double kQuietRadius = 3.75;

}  // namespace trammel::part_alignment
