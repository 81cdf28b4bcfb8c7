// scan.json, the file of a laser's recording.
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "pressure_advance/files/recording.h"

TRAMMEL_FUZZ_TARGET(scan_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto scan = files::ParseScan(std::string(fuzz::Text(data, size)), "scan.json");
  if (!fuzz::Good(scan)) return 0;
  const std::string text = files::FormatScan(*scan, nullptr);
  const auto again = files::ParseScan(text, "scan.json");
  fuzz::Require(fuzz::Good(again), "a scan that was written can be read");
  fuzz::Require(files::FormatScan(*again, nullptr) == text, "a scan reads back as it was written");
  return 0;
}
