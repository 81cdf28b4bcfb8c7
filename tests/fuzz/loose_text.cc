// Python's literals, plain YAML and plain XML, as other programs write cameras.
#include "store/loose_text.h"

#include "fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  (void)fuzz::Good(store::ParseLiteral(text, "camera"));
  (void)fuzz::Good(store::ParsePlainYaml(text, "camera.yaml"));
  (void)fuzz::Good(store::ParsePlainXml(text, "camera.xml"));
  return 0;
}
