// Two doubles at a time, a place in a picture: (x, y).
#pragma once

#include <cstdint>

namespace trammel::part_alignment {

typedef double Two __attribute__((vector_size(16)));
typedef std::int32_t TwoInts __attribute__((vector_size(8)));

/// The nearest pixel. REQUIRES no place left of or above the first.
inline TwoInts NearestPixel(Two place) { return __builtin_convertvector(place + 0.5, TwoInts); }

}  // namespace trammel::part_alignment
