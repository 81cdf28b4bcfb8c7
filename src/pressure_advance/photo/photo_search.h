// Photo in which patterns are searched.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "vision/comb_finder.h"

namespace trammel::pressure_advance {

/// Photos are measured with no more px than these. Sufficient: lines of 20 px are read to a percent
/// of their width.
inline constexpr double kMaxMeasured_px = 12e6;
inline constexpr int kLongestMeasured_px = 6000;

/// Photo at the size in which it is measured. Combs are searched once, at the first call.
class PhotoSearch {
 public:
  /// @param photo  8-bit BGR; may be empty. Reduced if it is larger than what is measured.
  explicit PhotoSearch(Frame photo);

  /// Size of the photo before reduction.
  [[nodiscard]] int photo_width_px() const { return photo_width_px_; }
  [[nodiscard]] int photo_height_px() const { return photo_height_px_; }
  [[nodiscard]] const Frame& picture() const { return picture_; }
  /// As vision::FindCombs. REQUIRES at least 16 px each way, like InColours.
  [[nodiscard]] const std::vector<vision::FoundComb>& Combs();
  /// Returns the same picture in which a grey one's colours are its texture; itself if coloured.
  [[nodiscard]] PhotoSearch& InColours();

 private:
  int photo_width_px_, photo_height_px_;
  Frame picture_;
  std::optional<std::vector<vision::FoundComb>> combs_;
  std::optional<bool> grey_;
  std::unique_ptr<PhotoSearch> textured_;  // of a grey one
};

}  // namespace trammel::pressure_advance
