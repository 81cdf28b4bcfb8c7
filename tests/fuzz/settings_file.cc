// trammel.toml and --set.
#include "app/config/config_file.h"
#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(settings_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  auto config = files::ParseConfig(parts[0], "trammel.toml");
  if (!fuzz::Good(config)) return 0;
  (void)fuzz::Good(files::OverrideConfig(parts[1], *config, "scan"));
  if (!fuzz::Good(files::ValidateConfig(*config, parts[0], "trammel.toml"))) return 0;
  (void)files::SheetOf(*config);
  return 0;
}
