// Requests to the virtual mill.
#include <cmath>
#include <string>

#include "fuzz.h"
#include "sim/spindle/mill.h"

TRAMMEL_FUZZ_TARGET(sim_mill)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const sim::MillOptions options;
  sim::VirtualMill mill(options);
  double now_s = 0;
  std::string_view text = fuzz::Text(data, size);
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string answer = mill.Answer(std::string(text.substr(0, end)), now_s);
    constexpr std::size_t kFacts = 1000;  // bytes of its longest answer
    fuzz::Require(answer.size() <= 6 * size + kFacts, "an answer is not much longer than its line");
    text = end == text.npos ? std::string_view() : text.substr(end + 1);
    constexpr double kStep_s = 0.25;
    now_s += kStep_s;
    const sim::MillPlace at = mill.At(now_s);
    for (std::size_t i = 0; i < 3; ++i) {
      fuzz::Require(at.stated_mm[i] >= options.travel_low_mm[i] &&
                        at.stated_mm[i] <= options.travel_high_mm[i],
                    "the axes stay within their limits");
    }
    fuzz::Require(std::isfinite(at.c_deg), "C is somewhere");
  }
  return 0;
}
