// A kept result, read again to be applied.
#include "fuzz.h"
#include "measurement/outcome_file.h"

TRAMMEL_FUZZ_TARGET(result_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto outcome = files::ParseOutcome(fuzz::Text(data, size), "result.json");
  if (outcome) (void)fuzz::Good(files::ParseOutcome(files::ToJson(*outcome), "again.json"));
  return 0;
}
