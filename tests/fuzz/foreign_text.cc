// Python's literals, plain YAML and plain XML, as other programs write cameras.
#include "files/foreign_text.h"

#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(foreign_text)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  (void)fuzz::Good(files::ParseLiteral(text, "camera"));
  (void)fuzz::Good(files::ParsePlainYaml(text, "camera.yaml"));
  (void)fuzz::Good(files::ParsePlainXml(text, "camera.xml"));
  return 0;
}
