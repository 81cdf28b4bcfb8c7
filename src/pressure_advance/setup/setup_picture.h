// A picture of a camera's setup: from where it was taken, and what was read in it.
#pragma once

#include <optional>
#include <string>

#include "pressure_advance/setup/mark_reading.h"
#include "pressure_advance/setup/observations.h"
#include "pressure_advance/setup/stripe_reading.h"

namespace trammel::pressure_advance {

struct SetupPicture {
  std::string file;  ///< in the recording's folder
  HeadPlace head;
  std::string kind;  ///< "stripe", "search", "mark", "check" or "shown"
  std::optional<StripeReading> stripe = {};
  std::optional<MarkReading> mark = {};
};

}  // namespace trammel::pressure_advance
