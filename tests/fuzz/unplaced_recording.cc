// sweeps.json, where a scan ended before any frame was placed.
#include "pressure_advance/files/unplaced_recording.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(unplaced_recording)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("sweeps.json");
  file.Write(fuzz::Text(data, size));
  const auto why = files::UnplacedRecording(file.path().parent_path());
  fuzz::Require(why.has_value(), "of a folder with sweeps.json it is said why it has no scan.json");
  fuzz::RequireMessage(*why);
  return 0;
}
