// The texture of a plate, where a picture has no colours that tell filament from it.
#pragma once

#include "base/frame.h"

namespace trammel::vision {

/// Whether blue, green and red are alike in every pixel, but for what a JPEG rounds.
[[nodiscard]] bool IsGrey(const BgrView& picture);

/// Puts the local spread of brightness in place of two of a grey picture's alike channels:
/// brightness stays in the blue one; green and red are the spreads over about 2 and 4 px of a
/// picture of 1920 px. Translucent filament may be as bright as a textured plate, but is smooth.
/// @param picture  8-bit BGR. REQUIRES IsGrey.
[[nodiscard]] Frame WithTexture(const BgrView& picture);

/// Undoes WithTexture: brightness in all three channels.
void DropTexture(Frame& picture);

}  // namespace trammel::vision
