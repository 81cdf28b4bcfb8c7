// scan.json, the file of a laser's recording.
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "store/recording.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto scan = store::ParseScan(std::string(fuzz::Text(data, size)), "scan.json");
  if (!fuzz::Good(scan)) return 0;
  const std::string text = store::FormatScan(*scan, nullptr);
  const auto again = store::ParseScan(text, "scan.json");
  fuzz::Require(fuzz::Good(again), "a scan that was written can be read");
  fuzz::Require(store::FormatScan(*again, nullptr) == text, "a scan reads back as it was written");
  return 0;
}
