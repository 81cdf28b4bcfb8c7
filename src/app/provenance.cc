#include "app/provenance.h"

#include <fmt/chrono.h>

#include <cmath>
#include <ctime>
#include <utility>

namespace trammel::app {

std::string_view ProgramVersion() { return "trammel " TRAMMEL_VERSION; }

std::string UtcNow() { return UtcOf(static_cast<double>(std::time(nullptr))); }

std::string UtcOf(double since_1970_s) {
  constexpr double kYear9999_s = 253402300799;
  if (!(since_1970_s >= 0 && since_1970_s <= kYear9999_s)) return fmt::format("{}", since_1970_s);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                     fmt::gmtime(static_cast<std::time_t>(std::floor(since_1970_s))));
}

measurement::Provenance ProvenanceOf(measurement::Instrument instrument,
                                     std::vector<std::string> sources) {
  return {instrument, std::string(ProgramVersion()), UtcNow(), std::move(sources)};
}

std::string RecordingName(measurement::Instrument instrument) {
  return fmt::format("{}-{:%Y%m%dT%H%M%SZ}", ToString(instrument), fmt::gmtime(std::time(nullptr)));
}

}  // namespace trammel::app
