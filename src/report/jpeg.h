// Photos and scans as JPEG: a fifth of what the same pixels take as PNG.
#pragma once

#include <string>

#include "base/frame.h"

namespace trammel::report {

/// Encodes as baseline JPEG, chroma at half resolution. REQUIRES a picture that is not empty and
/// 1 <= quality <= 100.
[[nodiscard]] std::string EncodeJpeg(const BgrView& picture, int quality);

}  // namespace trammel::report
