// Observations of a part, with and without views.
#include "store/alignment_file.h"

#include "fuzz.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("observations.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(store::ReadAlignmentFile(file.path()));
  const auto input = store::ReadAlignmentFile(file.path(), 0);
  if (!fuzz::Good(input)) return 0;
  const std::string text = store::AlignmentFileText(*input);
  file.Write(text);
  const auto again = store::ReadAlignmentFile(file.path(), 0);
  fuzz::Require(fuzz::Good(again), "observations that were written can be read");
  fuzz::Require(store::AlignmentFileText(*again) == text, "observations read back as written");
  return 0;
}
