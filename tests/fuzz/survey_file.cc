// The observations of a survey and its scale bars.
#include "part_alignment/files/survey_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(survey_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadSurveyFile(file.path()));
  (void)fuzz::Good(files::ReadScaleBarFile(file.path()));
  return 0;
}
