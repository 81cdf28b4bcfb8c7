#include "app/job_arguments.h"

namespace trammel::app {

Result<void> CheckTemperatureArgument(const std::string& text) {
  constexpr std::size_t kLongest = 6;
  const bool plain = !text.empty() && text.size() <= kLongest &&
                     text.find_first_not_of("0123456789.") == std::string::npos;
  if (plain) return {};
  return Fail("TEMP must be the nozzle's temperature in degC, such as 240 or 235.5");
}

}  // namespace trammel::app
