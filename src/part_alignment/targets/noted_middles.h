// Middles that were walked to and came to nothing.
#pragma once

#include <array>
#include <cstddef>

#include "part_alignment/targets/disc_search.h"

namespace trammel::part_alignment {

/// Some of the middles that were walked to: rows across one thing often lead to the very same.
class NotedMiddles {
 public:
  [[nodiscard]] bool Has(const Middle& middle, bool dark) const {
    const Noted& noted = PlaceOf(middle);
    return noted.is_set && noted.dark == dark && noted.middle == middle;
  }
  /// Instead of one that was noted in its place.
  void Note(const Middle& middle, bool dark) { noted_[IndexOf(middle)] = {middle, dark, true}; }

 private:
  struct Noted {
    Middle middle;
    bool dark = false;
    bool is_set = false;
  };
  static constexpr std::size_t kPlaces = 256;
  static std::size_t IndexOf(const Middle& middle) {
    return (static_cast<std::size_t>(2 * middle.column_px) +
            37 * static_cast<std::size_t>(2 * middle.row_px)) %
           kPlaces;
  }
  [[nodiscard]] const Noted& PlaceOf(const Middle& middle) const { return noted_[IndexOf(middle)]; }
  std::array<Noted, kPlaces> noted_;
};

}  // namespace trammel::part_alignment
