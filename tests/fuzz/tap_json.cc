// Recorded taps as JSON or JSON lines, and what the analysis makes of whatever they hold.
#include <cmath>

#include "fuzz.h"
#include "tap/analyse/analyse.h"
#include "tap/files/tap_file.h"

TRAMMEL_FUZZ_TARGET(tap_json)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto taps = files::ParseTaps(fuzz::Text(data, size), "taps.json");
  if (!fuzz::Good(taps)) return 0;
  fuzz::Require(!taps->empty(), "a file that can be read holds a tap");
  for (const tap::Recording& recording : *taps) {
    for (const tap::Method method : {tap::Method::kContact, tap::Method::kTwoLine}) {
      tap::TapOptions options;
      options.method = method;
      const tap::TapAnalysis result = tap::TapAnalyser(options).Analyse(recording.View());
      fuzz::Require((result.verdict == Verdict::kGood) == std::isfinite(result.contact_mm.value),
                    "a tap has a contact exactly where its verdict is good");
    }
  }
  return 0;
}
