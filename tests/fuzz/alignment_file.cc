// Observations of a part, with and without views.
#include "part_alignment/files/alignment_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(alignment_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("observations.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadAlignmentFile(file.path()));
  const auto input = files::ReadAlignmentFile(file.path(), 0);
  if (!fuzz::Good(input)) return 0;
  const std::string text = files::AlignmentFileText(*input);
  file.Write(text);
  const auto again = files::ReadAlignmentFile(file.path(), 0);
  fuzz::Require(fuzz::Good(again), "observations that were written can be read");
  fuzz::Require(files::AlignmentFileText(*again) == text, "observations read back as written");
  return 0;
}
