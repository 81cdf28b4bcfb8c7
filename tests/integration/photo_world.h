// Virtual photos of virtual sheets: photographed by sim, read by tool_offset.
#pragma once

#include <cstdint>

#include "offset_world.h"
#include "sim/phone/phone_photo.h"

namespace trammel {

/// The same phone again over the same print, which is turned by 180 degrees: another tilt, distance
/// and light.
[[nodiscard]] sim::PhoneTraits TakenAgain(const sim::PrintedSheet& sheet,
                                          const sim::PhoneTraits& phone, Random random);

/// Takes the photo, as a JPEG, and reads it with the focal length that the file states.
/// @param photo  its number among the print's.
[[nodiscard]] Result<tool_offset::SheetResult> SeePhoto(const PatternFile& pattern,
                                                        const sim::PrintedSheet& sheet,
                                                        const sim::PhoneTraits& phone,
                                                        const sim::SheetName& name,
                                                        std::uint64_t photo);

}  // namespace trammel
