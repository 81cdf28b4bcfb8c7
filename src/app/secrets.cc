#include "app/secrets.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>

#include "base/url_secrets.h"
#include "files/whole_file.h"

namespace trammel::app {

std::string FromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : value;
}

Result<std::string> SecretFrom(const std::string& file) {
  constexpr std::size_t kMaxBytes = 8192;
  auto text = files::ReadWholeFile(file, kMaxBytes);
  if (!text) return text;
  text->resize(std::min(text->find_first_of("\r\n"), text->size()));
  if (text->empty()) return Fail(fmt::format("{}: its first line is empty", file));
  return text;
}

Result<std::string> CameraAddressOf(const std::string& option, const std::string& given) {
  if (given.starts_with('@')) {
    auto address = SecretFrom(given.substr(1));
    if (!address) return Fail(fmt::format("{} {}", option, address.error().message));
    return address;
  }
  const std::string shown = WithoutSecrets(given);
  if (shown == given) return given;
  return Fail(fmt::format(
      "{} {}: everybody on this computer can read the words of a command, and this "
      "address holds a secret; write it into a file that only you can read, and {} @FILE",
      option, shown, option));
}

Result<void> SettleApiKey(settings::ScanSettings& settings) {
  const std::string from_environment = FromEnvironment("TRAMMEL_API_KEY");
  if (!settings.api_key.empty() && !settings.api_key_file.empty()) {
    return Fail("[moonraker] api_key and api_key_file: keep one of the two");
  }
  std::string source = "[moonraker] api_key";
  if (!from_environment.empty()) {
    settings.api_key = from_environment;
    source = "TRAMMEL_API_KEY";
  } else if (!settings.api_key_file.empty()) {
    auto key = SecretFrom(settings.api_key_file);
    if (!key) return Fail("[moonraker] api_key_file: " + key.error().message);
    settings.api_key = std::move(*key);
    source = settings.api_key_file;
  }
  const bool plain = std::all_of(settings.api_key.begin(), settings.api_key.end(),
                                 [](char c) { return c > ' ' && c <= '~'; });
  if (!plain) return Fail(source + ": a key has no blanks and no characters beyond ASCII");
  return {};
}

std::vector<std::string> FilesWithSecrets(const std::string& settings_file,
                                          const settings::ScanSettings& in_file,
                                          const std::string& key_file, const std::string& camera) {
  std::vector<std::string> files;
  if (!in_file.api_key.empty() || WithoutSecrets(in_file.camera) != in_file.camera) {
    files.push_back(settings_file);
  }
  if (!key_file.empty()) files.push_back(key_file);
  if (camera.starts_with('@')) files.push_back(camera.substr(1));
  return files;
}

std::vector<procedure::Check> CheckSecretFiles(const std::vector<std::string>& files) {
  std::vector<procedure::Check> checks;
  for (const std::string& file : files) {
    struct stat status {};
    if (stat(file.c_str(), &status) != 0 || (status.st_mode & 077U) == 0) continue;
    procedure::Check check{
        "secrets", false,
        fmt::format("{} holds one and others may read it: chmod 600 {}", file, file)};
    check.advice = true;
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace trammel::app
