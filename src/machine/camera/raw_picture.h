// Converts raw pixels and time stamps of industrial cameras to common formats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// Picture in memory, as GenICam cameras deliver it.
struct RawPicture {
  std::uint32_t pixel_format = 0;  ///< code of GenICam's pixel format naming convention (PFNC)
  int width_px = 0;
  int height_px = 0;
  std::size_t row_padding_bytes = 0;  ///< behind each row
  std::span<const std::uint8_t> bytes;
};

/// True if ToPicture() reads the format.
[[nodiscard]] bool IsReadPixelFormat(std::uint32_t pixel_format);

/// "Mono8, BayerGR8, …": those that are read, for messages.
[[nodiscard]] std::string ReadPixelFormats();

/// "Mono8"; where it is not one of those that are read, its number.
[[nodiscard]] std::string PixelFormatName(std::uint32_t pixel_format);

/// Interpolates Bayer patterns (bilinear); other values are unchanged.
/// @param jpeg_quality  0: PNG, lossless (grey keeps one channel); 1 … 100: JPEG.
/// @returns errors (kMachine): an unsupported format, a size below 1 px or above 50
///          megapixels, fewer bytes than the size needs.
[[nodiscard]] Result<std::vector<std::uint8_t>> ToPicture(const RawPicture& raw, int jpeg_quality);

/// Converts stamps of the wall clock, which may be set meanwhile, by comparing the two clocks at
/// each frame. After the wall clock was set, frames stamped before and after cannot be
/// distinguished and get no time for a while.
class WallStamps {
 public:
  /// @param wall_s      the stamp, s since 1970.
  /// @param wall_now_s  the wall clock now.
  /// @param host_now_s  the monotonic clock now; must not decrease from call to call.
  /// @returns the stamp on the monotonic clock, as exact as the two readings lie together; absent
  ///          for two seconds after the wall clock was set, and for a stamp that is missing (0) or
  ///          lies in the future.
  [[nodiscard]] std::optional<double> OnHostClock(double wall_s, double wall_now_s,
                                                  double host_now_s);

 private:
  std::optional<double> offset_s_;  ///< wall clock minus monotonic clock
  double compared_s_ = 0;
  std::optional<double> set_s_;  ///< time of the last detected change of the wall clock
};

}  // namespace trammel::machine
