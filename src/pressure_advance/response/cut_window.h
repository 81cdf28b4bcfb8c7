// What lies beyond the picture's border of a transition that the picture cuts.
#pragma once

#include <optional>
#include <span>

namespace trammel::pressure_advance {

/// A transition's surplus over its whole window, as far as a part of the window tells it.
struct CompletedWindow {
  double value = 0;
  double per_part = 0;  ///< d value / d part
  double sigma = 0;     ///< 1 sigma of what the part leaves open
};

/// Foretells a cut window from the lines that show all of theirs: a straight line of their whole
/// surpluses over those of the same part, in which lines with a like part count most. All lines end
/// their bulges and gaps alike, but for their own scatter.
/// @param parts   surpluses of the part, of the lines that show all; at least kFewestWhole, or the
///                answer is empty
/// @param wholes  those of the whole window; same length
/// @param part    of the line that shows no more
[[nodiscard]] std::optional<CompletedWindow> CompleteWindow(std::span<const double> parts,
                                                            std::span<const double> wholes,
                                                            double part);

/// Lines that must show all of a window before others are completed by them.
inline constexpr std::size_t kFewestWhole = 5;

}  // namespace trammel::pressure_advance
