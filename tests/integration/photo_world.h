// Virtual photos of virtual sheets: printed and photographed by sim, read by tool_offset.
#pragma once

#include "offset_world.h"
#include "sim/phone/phone_photo.h"
#include "tool_offset/offset/analyse.h"

namespace trammel {

/// The sheet that the name draws, black on white.
[[nodiscard]] sim::PrintedSheet PrintForPhoto(const PatternFile& pattern,
                                              const sim::SheetName& name);

/// The same phone again over the same print, which is turned by 180 degrees: another tilt, distance
/// and light.
[[nodiscard]] sim::PhoneTraits TakenAgain(const sim::PrintedSheet& sheet,
                                          const sim::PhoneTraits& phone, Random random);

/// Takes the photo, as a JPEG, and reads it with the focal length that the file states.
/// @param photo  which of the print's.
[[nodiscard]] Result<tool_offset::SheetResult> SeePhoto(
    const PatternFile& pattern, const sim::PrintedSheet& sheet, const sim::PhoneTraits& phone,
    const sim::SheetName& name, std::uint64_t photo, const tool_offset::RadialSpread& spread = {});

}  // namespace trammel
