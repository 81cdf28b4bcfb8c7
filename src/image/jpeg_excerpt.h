// A part of a JPEG as a JPEG of its own, whose coefficients are copied without being decoded.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/frame.h"

namespace trammel::image {

/// Takes parts out of the pictures of one camera, several times as fast as a decoder passes over
/// what it leaves out; what one picture has in common with the next is kept.
class JpegExcerpter {
 public:
  JpegExcerpter();
  JpegExcerpter(JpegExcerpter&&) noexcept;
  JpegExcerpter& operator=(JpegExcerpter&&) noexcept;
  ~JpegExcerpter();

  /// Makes a JPEG of the fewest MCUs in which `part` is exact (CutAround()): its pixels there are
  /// the whole's to the bit. All entropy-coded data are gone through to the picture's end, so that
  /// bytes lost anywhere are missed. REQUIRES that `part` lies within the picture.
  /// @returns false where it is none of the JPEGs that cameras write (baseline, one scan, grey or
  ///          three colours), or where anything in it is not as it should be: JpegReader says what.
  [[nodiscard]] bool Take(std::span<const std::uint8_t> jpeg, const PixelRect& part);

  /// The excerpt, and where it lies in the whole. REQUIRES that Take() said true.
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const;
  [[nodiscard]] const PixelRect& rect() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trammel::image
