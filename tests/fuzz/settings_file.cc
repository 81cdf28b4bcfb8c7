// trammel.toml and --set.
#include "fuzz.h"
#include "store/config_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  auto config = store::ParseConfig(parts[0], "trammel.toml");
  if (!fuzz::Good(config)) return 0;
  (void)fuzz::Good(store::OverrideConfig(parts[1], *config, "scan"));
  if (!fuzz::Good(store::ValidateConfig(*config, parts[0], "trammel.toml"))) return 0;
  (void)store::SheetOf(*config);
  return 0;
}
