#include "part_alignment/targets/target.h"

#include <algorithm>

namespace trammel::part_alignment {

std::string_view ToString(RejectReason reason) {
  switch (reason) {
    case RejectReason::kMirrored:
      return "mirrored";
    case RejectReason::kWrongCode:
      return "wrong_code";
    case RejectReason::kDoubled:
      return "doubled";
    case RejectReason::kHidden:
      return "hidden";
    case RejectReason::kAtBorder:
      return "at_border";
    case RejectReason::kTooSmall:
      return "too_small";
    case RejectReason::kSaturated:
      return "saturated";
    case RejectReason::kDamaged:
      return "damaged";
    case RejectReason::kFaint:
      return "faint";
    case RejectReason::kUneven:
      return "uneven_light";
  }
  return "";
}

std::string WordsFor(RejectReason reason) {
  switch (reason) {
    case RejectReason::kMirrored:
      return "its code is in the book as a mirror would show it: the picture, or the print, is "
             "mirrored";
    case RejectReason::kWrongCode:
      return "its code is none of this book's: no target, one printed with another --bits, or part "
             "of its ring is covered";
    case RejectReason::kDoubled:
      return "the same code is read at two places: one target is on the part twice, or mirrored in "
             "something that shines";
    case RejectReason::kHidden:
      return "parts of its ring are covered, or neither light nor dark";
    case RejectReason::kAtBorder:
      return "the picture ends within its ring";
    case RejectReason::kTooSmall:
      return "it is too small to be read: go closer";
    case RejectReason::kSaturated:
      return "it is too bright or too dark to place its edge: change the light or the exposure";
    case RejectReason::kDamaged:
      return "its disc is no clean ellipse: dirt, damage, or no target";
    case RejectReason::kFaint:
      return "its ink differs too little from what is about it: more light, or a better print";
    case RejectReason::kUneven:
      return "the light differs across it: a shadow's edge or a lamp's image lies on it";
    default:
      break;
  }
  std::string words(ToString(reason));
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace trammel::part_alignment
