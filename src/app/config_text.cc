#include "app/config_text.h"

#include <filesystem>
#include <system_error>

#include "app/config/config_file.h"
#include "files/whole_file.h"

namespace trammel::app {

Result<ConfigText> FindConfig(const std::string& asked_for) {
  constexpr const char* kDefaultFile = "trammel.toml";
  std::error_code ignored;
  if (asked_for.empty() && !std::filesystem::exists(kDefaultFile, ignored)) {
    return ConfigText{"", "defaults (there is no trammel.toml here)"};
  }
  const std::string file = asked_for.empty() ? kDefaultFile : asked_for;
  std::string text = TRY(files::ReadWholeFile(file, files::kMaxConfigBytes));
  return ConfigText{std::move(text), file};
}

}  // namespace trammel::app
