// plan.json beside a pressure-advance pattern, as the analysis and as the virtual shop read it.
#include "sim/print/plan_file.h"

#include "fuzz.h"
#include "pressure_advance/files/plan_file.h"

TRAMMEL_FUZZ_TARGET(plan_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  (void)fuzz::Good(sim::ParsePlan(text));
  const auto plan = files::ParsePlan(text, "plan.json");
  if (!fuzz::Good(plan)) return 0;
  const std::string written = files::FormatPlan(*plan);
  const auto again = files::ParsePlan(written, "plan.json");
  fuzz::Require(fuzz::Good(again), "a plan that was written can be read");
  fuzz::Require(files::FormatPlan(*again) == written, "a plan reads back as it was written");
  return 0;
}
