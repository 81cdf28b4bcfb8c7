// The strict reader of JSON that all files share.
#include <nlohmann/json.hpp>

#include "files/json_object.h"
#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(json_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto json = files::ParseJson(fuzz::Text(data, size), "file.json");
  if (!fuzz::Good(json)) return 0;
  files::JsonObject object(*json, "file.json");
  (void)object.Number("number", {-1, 1}, 0);
  (void)object.Integer("integer", {0, 100});
  (void)object.Text("text");
  (void)object.OptionalChoice("choice", {"one", "other"});
  (void)object.Numbers("numbers", 0, 10);
  (void)object.OptionalNumbers("some", 0, 10);
  (void)fuzz::Good(object.Finish());
  fuzz::Require(files::Show(*json).size() <= 60, "a value that is shown is short");
  return 0;
}
