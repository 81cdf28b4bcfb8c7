#include "app/provenance.h"

#include <fmt/chrono.h>

#include <ctime>
#include <utility>

namespace trammel::app {

std::string_view ProgramVersion() { return "trammel " TRAMMEL_VERSION; }

std::string UtcNow() { return UtcAfterDays(0); }

std::string UtcAfterDays(double days) {
  const auto seconds = static_cast<std::time_t>(days * 86400);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr) + seconds));
}

measurement::Provenance ProvenanceOf(measurement::Instrument instrument,
                                     std::vector<std::string> sources) {
  return {instrument, std::string(ProgramVersion()), UtcNow(), std::move(sources)};
}

std::string RecordingName(measurement::Instrument instrument) {
  return fmt::format("{}-{:%Y%m%dT%H%M%SZ}", ToString(instrument), fmt::gmtime(std::time(nullptr)));
}

}  // namespace trammel::app
