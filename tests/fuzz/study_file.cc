// The results that a study keeps, one a scan.
#include "app/study/study_scan.h"
#include "app/study/study_summary.h"
#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(study_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  (void)fuzz::Good(app::ParseStudyValidation(text, "file.json"));
  const auto scan = app::ParseStudyScan(text, "file.json");
  if (!fuzz::Good(scan)) return 0;
  const auto again = app::ParseStudyScan(app::FormatStudyScan(*scan), "file.json");
  fuzz::Require(again.has_value(), "a scan that was read can be written and read again");
  (void)app::SummaryText({app::Summarize(scan->condition, {*scan}, std::nullopt)});
  return 0;
}
